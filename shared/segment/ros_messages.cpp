// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/ros_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "shared/segment/tick_table.hpp"

namespace kerf {
namespace {

/// Writes a message in CDR into a buffer: little-endian, each number aligned to its size.
class CdrWriter {
 public:
  explicit CdrWriter(std::string& bytes) : bytes_(bytes) {
    bytes_.assign("\0\1\0\0", kHead);  // plain CDR, little-endian
  }
  template <class Number>
  void number(Number value) {
    align(sizeof value);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_ += value;
    bytes_ += '\0';
  }
  /// `count` numbers of `each` bytes per number.
  void numbers(const std::byte* values, std::size_t each, std::size_t count) {
    align(each);
    bytes_.append(reinterpret_cast<const char*>(values), each * count);
  }

 private:
  static constexpr std::size_t kHead = 4;
  void align(std::size_t to) {
    const std::size_t at = bytes_.size() - kHead;
    bytes_.append((to - at % to) % to, '\0');
  }
  std::string& bytes_;
};

constexpr std::string_view kRule =
    "\n================================================================================\nMSG: ";
constexpr std::string_view kHeaderDefinition =
    "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id";
constexpr std::string_view kTimeDefinition = "builtin_interfaces/Time\nint32 sec\nuint32 nanosec";
constexpr std::string_view kVectorDefinition =
    "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z";
constexpr std::string_view kQuaternionDefinition =
    "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w";

template <class... Parts>
std::string joined(std::string_view first, Parts... parts) {
  std::string text(first);
  ((text += kRule, text += parts), ...);
  return text;
}

std::string pose_definition() {
  return joined("std_msgs/Header header\ngeometry_msgs/Pose pose", kHeaderDefinition,
                kTimeDefinition,
                "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion "
                "orientation",
                "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z", kQuaternionDefinition);
}

std::string wrench_definition() {
  return joined("std_msgs/Header header\ngeometry_msgs/Wrench wrench", kHeaderDefinition,
                kTimeDefinition,
                "geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
                kVectorDefinition);
}

/// The name of a number type in a ROS 2 definition: f64 is float64, u16 is uint16.
std::string ros_type(std::string_view type) {
  const char kind = type.front();
  const std::string bits(type.substr(1));
  return (kind == 'f' ? "float" : kind == 'u' ? "uint" : "int") + bits;
}

std::string frames_definition() {
  return joined("geometry_msgs/TransformStamped[] transforms",
                "geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
                "geometry_msgs/Transform transform",
                kHeaderDefinition, kTimeDefinition,
                "geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
                "geometry_msgs/Quaternion rotation",
                kVectorDefinition, kQuaternionDefinition);
}

/// The name of a constant: of FLAGS "button 1" is FLAGS_BUTTON_1.
std::string constant_name(std::string_view column, std::string_view code) {
  std::string name = std::string(column) + "_" + std::string(code);
  for (char& c : name) c = c == ' ' ? '_' : 'a' <= c && c <= 'z' ? static_cast<char>(c - 32) : c;
  return name;
}

/// One line per column: type, name, unit and meaning; before it one for each of its codes or bits.
std::string tick_definition() {
  std::string text =
      "# A tick of kerf's servo. docs/log.md has the same columns; made by `kerf record columns "
      "--msg`.\n";
  for (const TickField& row : kTickFields) {
    const LayoutField& field = row.layout;
    const std::string many = field.count > 1 ? "[" + std::to_string(field.count) + "]" : "";
    for (const TickCode& code : tick_codes(field.name)) {
      text += ros_type(field.type) + " " + constant_name(field.name, code.name) + "=" +
              std::to_string(code.value) +
              (code.meaning.empty() ? "" : "  # " + std::string(code.meaning)) + "\n";
    }
    const std::string unit = row.unit.empty() ? "" : std::string(row.unit) + ": ";
    text += ros_type(field.type) + many + " " + std::string(field.name) + "  # " + unit +
            std::string(row.meaning) + "\n";
  }
  return text;
}

void put_tick(const TickRecord& record, CdrWriter message) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(&record);
  for (const auto& [field, unit, made, meaning, valid] : kTickFields) {
    message.numbers(bytes + field.offset, type_bytes(field.type), field.count);
  }
}

void put_header(std::int64_t time_ns, std::string_view frame, CdrWriter& message) {
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  const std::int64_t ns = (time_ns % kNsPerS + kNsPerS) % kNsPerS;  // counts up before 1970, too
  message.number(static_cast<std::int32_t>((time_ns - ns) / kNsPerS));
  message.number(static_cast<std::uint32_t>(ns));
  message.text(frame);
}

void put_tip(const TickRecord& record, std::int64_t time_ns, CdrWriter message) {
  put_header(time_ns, "scene", message);
  for (const double mm : record.position_mm) message.number(mm / 1000);
  for (const float part : record.orientation) message.number(double{part});
}

void put_force(const TickRecord& record, std::int64_t time_ns, std::size_t arm, CdrWriter message) {
  put_header(time_ns, arm == 0 ? "device" : "device_2", message);
  for (const float n : record.commanded_force_n) message.number(double{n});
  for (const float n_mm : record.tip_torque_n_mm) message.number(double{n_mm} / 1000);
}

/// A frame in the scene.
void put_frame(std::int64_t time_ns, std::string_view name, std::span<const double, 3> at_mm,
               std::span<const float, 4> rotation, CdrWriter& message) {
  put_header(time_ns, "scene", message);
  message.text(name);
  for (const double mm : at_mm) message.number(mm / 1000);
  for (const float part : rotation) message.number(double{part});
}

}  // namespace

RosChannel ros_frames_channel() {
  return {"/tf", "tf2_msgs/msg/TFMessage", frames_definition()};
}

std::array<RosChannel, kRosTopics> ros_channels(std::size_t arm) {
  constexpr std::array<std::array<std::string_view, kRosTopics>, kMaxArms> kTopics{
      {{"/kerf/tick", "/kerf/tip", "/kerf/force"},
       {"/kerf/2/tick", "/kerf/2/tip", "/kerf/2/force"}}};
  const auto& topics = kTopics[arm];
  return {{{topics[ros_tick], "kerf_msgs/msg/Tick", tick_definition()},
           {topics[ros_tip], "geometry_msgs/msg/PoseStamped", pose_definition()},
           {topics[ros_force], "geometry_msgs/msg/WrenchStamped", wrench_definition()}}};
}

RosMessages::RosMessages(std::uint64_t tick_ns, std::int64_t offset_ns) noexcept
    : offset_ns_(offset_ns) {
  constexpr std::uint64_t kViewNs = 10'000'000;
  ticks_a_view_ = std::max<std::uint64_t>(1, kViewNs / std::max<std::uint64_t>(1, tick_ns));
}

std::int64_t RosMessages::time_ns(const TickRecord& record) const noexcept {
  return static_cast<std::int64_t>(record.start_ns + static_cast<std::uint64_t>(offset_ns_));
}

bool RosMessages::has(RosTopic topic, const TickRecord& record) const noexcept {
  if (topic == ros_tick) return true;
  if (record.tick % ticks_a_view_ != 0) return false;
  return topic != ros_tip || std::isfinite(record.position_mm[0]);
}

std::string_view RosMessages::message(RosTopic topic, const TickRecord& record, std::size_t arm) {
  const CdrWriter out(cdr_);
  if (topic == ros_tick) put_tick(record, out);
  if (topic == ros_tip) put_tip(record, time_ns(record), out);
  if (topic == ros_force) put_force(record, time_ns(record), arm, out);
  return cdr_;
}

std::string_view RosMessages::frames(const TickRecord& record, std::size_t arm,
                                     const std::array<double, 3>& device_mm) {
  CdrWriter out(cdr_);
  const bool has_tip = has(ros_tip, record);
  out.number(std::uint32_t{has_tip ? 2U : 1U});
  constexpr std::array<float, 4> kParallel{0, 0, 0, 1};
  put_frame(time_ns(record), arm == 0 ? "device" : "device_2", device_mm, kParallel, out);
  if (has_tip) {
    put_frame(time_ns(record), arm == 0 ? "tip" : "tip_2", record.position_mm, record.orientation,
              out);
  }
  return cdr_;
}

}  // namespace kerf
