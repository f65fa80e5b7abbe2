// SPDX-License-Identifier: Apache-2.0
#include "record/export/mcap_export.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "record/input_rows.hpp"
#include "record/kept_volumes.hpp"
#include "record/packed_npy.hpp"
#include "record/recording.hpp"
#include "record/scene_facts.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/ros_messages.hpp"
#include "shared/segment/tick_table.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

/// Each column begins where the one before ends: CDR, which aligns as the record does, adds
/// nothing.
constexpr bool has_no_padding() {
  std::uint32_t end = 0;
  for (const auto& [field, unit, made, meaning, valid] : kTickFields) {
    if (field.offset != end) return false;
    end += type_bytes(field.type) * field.count;
  }
  return end == sizeof(TickRecord);
}
static_assert(has_no_padding(), "mcap_export.hpp: the bytes of a message are those of a row");

/// Reads a regular file of at most `most` bytes into `content`. Returns why that is not possible,
/// else nothing.
const char* read_into(std::string& content, const std::filesystem::path& path,
                      std::uintmax_t most) {
  constexpr const char* kUnreadable = "no file, or one that cannot be read";
  std::error_code fault;
  if (!std::filesystem::is_regular_file(path, fault)) return kUnreadable;  // a pipe would block
  std::ifstream file(path, std::ios::binary);
  const std::uintmax_t bytes = std::filesystem::file_size(path, fault);
  if (!file.is_open() || fault) return kUnreadable;
  if (bytes > most) return "larger than that of any recording";
  content.resize(static_cast<std::size_t>(bytes));
  const bool is_read = bool(file.read(content.data(), static_cast<std::streamsize>(bytes)));
  return is_read ? nullptr : kUnreadable;
}

/// Rows by the header of each arm's log. A reader of a cut log reports the cut by the count; rows
/// behind the count are complete.
std::vector<std::uint64_t> counts_of_rows(const std::filesystem::path& folder,
                                          const Manifest& manifest) {
  std::vector<std::uint64_t> counts;
  for (const TickLogReader& log : open_logs(folder, manifest.arms)) {
    counts.push_back(std::max(log.rows(), log.counted()));
  }
  return counts;
}

std::string no_such_time(const std::filesystem::path& folder, std::int64_t time_ns) {
  return (folder / kClockName).string() + ": " + date_text(time_ns) +
         " is no date of an MCAP for " +
         "ROS 2, which has 1970 to 2038-01-19; give --time monotonic";
}

using Places = std::vector<std::array<double, 3>>;

/// Where the devices are in the scene, in mm. None, and a line, if scene.json has not all of them.
Places device_places(const std::filesystem::path& folder, std::size_t arms,
                     std::vector<std::string>& left_out) {
  Places places;
  try {
    const Json scene = Json::parse(recorded_scene(folder));
    for (const char* const device : {"device", "second_device"}) {
      if (places.size() == arms) break;
      places.push_back(scene.at(device).at("offset_mm").get<std::array<double, 3>>());
    }
    return places;
  } catch (const JsonError&) {    // NOLINT(bugprone-empty-catch): reported below
  } catch (const RecordError&) {  // NOLINT(bugprone-empty-catch): reported below
  }
  left_out.push_back((folder / kSceneName).string() +
                     ": no device.offset_mm, so the MCAP has no /tf; copy the recording again");
  return {};
}

/// What a replay needs besides the ticks, whose `counts` were read before them. Adds a line for
/// each file that is left out.
void attach_files(const std::filesystem::path& folder, const std::vector<std::uint64_t>& counts,
                  bool has_clock, McapWriter& writer, std::vector<std::string>& left_out) {
  const auto leave_out = [&](const std::filesystem::path& path, const std::string& value) {
    left_out.push_back(path.string() + ": " + value +
                       ", so the MCAP is without it; copy the recording again");
  };
  const auto attach = [&](const std::string& name, std::string_view type, std::uintmax_t most) {
    std::string content;
    if (const char* const why = read_into(content, folder / name, most)) {
      leave_out(folder / name, why);
    } else {
      writer.attach(name, type, content);
    }
  };
  attach(std::string(kManifestName), "application/json", kMostManifestBytes);
  attach(std::string(kSceneName), "application/json", kMaxSceneBytes);
  if (has_clock) attach(std::string(kClockName), "application/octet-stream", kMostClockBytes);
  constexpr std::uintmax_t kMostVolumeBytes =
      most_packed_bytes(std::uintmax_t{kMaxBricks} * kBrickVoxels * sizeof(Density));
  for (const std::string_view below : {kVolumesName, inputs_name(0), inputs_name(1)}) {
    std::vector<std::string> names;
    std::error_code fault;
    for (const auto& entry : std::filesystem::directory_iterator(folder / below, fault)) {
      names.push_back(std::string(below) + "/" + entry.path().filename().string());
    }
    // A recording may have no such folder.
    if (fault && fault != std::errc::no_such_file_or_directory) {
      leave_out(folder / below, fault.message());
    }
    std::ranges::sort(names);
    const std::uintmax_t most = below == kVolumesName
                                    ? kMostVolumeBytes
                                    : most_packed_bytes(kInputsAFile * sizeof(TickInputs));
    for (const std::string& name : names) attach(name, "application/gzip", most);
  }
  for (std::size_t arm = 0; arm < counts.size(); ++arm) {
    writer.attach(std::string(tick_log_name(arm)) + ".head", "application/octet-stream",
                  tick_log_header(counts[arm]));
  }
}

}  // namespace

std::vector<std::string> export_mcap(const std::filesystem::path& folder,
                                     const std::filesystem::path& mcap, McapWriter::Packing packing,
                                     TickRange range, const LogClock& clock) {
  check_outputs(recording_files(folder), {{"--mcap", mcap, ".mcap"}});
  const Manifest manifest = read_facts(folder);
  AtomicFile file(mcap);
  McapWriter writer([&](std::string_view bytes) { file.write(bytes.data(), bytes.size()); }, "ros2",
                    "kerf " KERF_VERSION, packing);
  const auto add = [&](const RosChannel& one) {
    return writer.add({std::string(one.topic),
                       std::string(one.schema),
                       one.definition,
                       std::string(kRosSchemaEncoding),
                       std::string(kRosEncoding),
                       {{"offered_qos_profiles", std::string(kRosQos)}}});
  };
  std::vector<std::uint16_t> channels;  // of the first arm by topic, then of the second
  for (std::size_t arm = 0; arm < manifest.arms; ++arm) {
    for (const RosChannel& one : ros_channels(arm)) channels.push_back(add(one));
  }
  const std::uint16_t frames = add(ros_frames_channel());
  std::vector<std::string> left_out;
  const Places devices_mm = device_places(folder, manifest.arms, left_out);
  RosMessages messages(manifest.tick_ns, clock.offset_ns());
  std::uint64_t last_ns = 0;
  const auto write_arm = [&](const TickRecord& record, std::size_t arm) {
    const std::int64_t time_ns = messages.time_ns(record);
    if (time_ns < 0 || time_ns >= kRosTimeEndNs) throw RecordError(no_such_time(folder, time_ns));
    last_ns = std::max(last_ns, static_cast<std::uint64_t>(time_ns));
    for (const RosTopic topic : {ros_tick, ros_tip, ros_force}) {
      if (!messages.has(topic, record)) continue;
      writer.message(channels[arm * kRosTopics + topic], last_ns,
                     messages.message(topic, record, arm));
    }
    if (arm < devices_mm.size() && messages.has(ros_force, record)) {
      writer.message(frames, last_ns, messages.frames(record, arm, devices_mm[arm]));
    }
  };
  // Before the messages: a recording that still grows has more rows afterwards.
  const std::vector<std::uint64_t> counts = counts_of_rows(folder, manifest);
  for_each_tick(folder, manifest, range, [&](const TickRecord& first, const TickRecord* second) {
    write_arm(first, 0);
    if (second != nullptr) write_arm(*second, 1);
  });
  if (range.is_whole()) attach_files(folder, counts, manifest.has_clock, writer, left_out);
  writer.close();
  file.close();
  file.commit();
  return left_out;
}

}  // namespace kerf
