// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "shared/segment/layout.hpp"

// Tick records as ROS 2 messages, for programs that do not know kerf: Foxglove, PlotJuggler.

namespace kerf {

inline constexpr std::string_view kRosEncoding = "cdr";            ///< of the messages' bytes
inline constexpr std::string_view kRosSchemaEncoding = "ros2msg";  ///< of the message definitions

/// A topic, and the type of its messages.
struct RosChannel {
  std::string_view topic;
  std::string_view schema;  ///< name of the message type
  std::string definition;   ///< of the type and of all types that it contains
};

/// The channels of an arm; the enumerator is the index in the result of `ros_channels`:
///
///     /kerf/tick    kerf_msgs/msg/Tick              every column of docs/log.md, in their order
///     /kerf/tip     geometry_msgs/msg/PoseStamped   tip in m and orientation, in frame "scene"
///     /kerf/force   geometry_msgs/msg/WrenchStamped commanded force in N and tip torque in N m, in
///                                                   frame "device"
///
/// The second arm has /kerf/2/tick, /kerf/2/tip and /kerf/2/force, the last in frame "device_2".
/// The definition of kerf_msgs/msg/Tick is ros/kerf_msgs/msg/Tick.msg, a package for ROS 2. Stamps
/// are `start_ns`, or that with an offset.
enum RosTopic : std::uint8_t { ros_tick, ros_tip, ros_force };
inline constexpr std::size_t kRosTopics = 3;
[[nodiscard]] std::array<RosChannel, kRosTopics> ros_channels(std::size_t arm = 0);

/// The channel of the frames of all arms:
///
///     /tf           tf2_msgs/msg/TFMessage           where "device" and "tip" are in "scene"; of
///     the
///                                                   second arm "device_2" and "tip_2"
[[nodiscard]] RosChannel ros_frames_channel();

/// What a publisher of these topics offers: reliable, volatile, the last 100 kept. YAML, as rosbag2
/// reads it from a recording; numbers are of rmw/types.h, which each of its releases takes.
inline constexpr std::string_view kRosQos = R"(- history: 1
  depth: 100
  reliability: 1
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
)";

/// Stamps have whole seconds in 32 bits: this time and later ones, of 2038, cannot be one.
inline constexpr std::int64_t kRosTimeEndNs = (std::int64_t{1} << 31) * 1'000'000'000;

/// Makes the messages of a run with ticks of `tick_ns`, whose stamps are `start_ns` + `offset_ns`.
class RosMessages {
 public:
  explicit RosMessages(std::uint64_t tick_ns, std::int64_t offset_ns = 0) noexcept;

  /// The stamp of a record's messages.
  [[nodiscard]] std::int64_t time_ns(const TickRecord& record) const noexcept;

  /// True if a tick has a message of this topic. Tip and force have about 100 messages per second;
  /// `ros_tick` has all values of each tick. There is no tip while the position is unknown.
  [[nodiscard]] bool has(RosTopic topic, const TickRecord& record) const noexcept;
  /// The message for the record of an arm; valid until the next call.
  [[nodiscard]] std::string_view message(RosTopic topic, const TickRecord& record,
                                         std::size_t arm = 0);

  /// The message of `ros_frames_channel` for the record of an arm, as often as `ros_force`. The
  /// device's axes are parallel to the scene's; its origin is at `device_mm` in the scene, the
  /// scene's `device.offset_mm`. The tip is missing while its position is unknown.
  [[nodiscard]] std::string_view frames(const TickRecord& record, std::size_t arm,
                                        const std::array<double, 3>& device_mm);

 private:
  std::uint64_t ticks_a_view_;
  std::int64_t offset_ns_;
  std::string cdr_;
};

}  // namespace kerf
