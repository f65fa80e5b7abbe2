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
/// Stamps are `start_ns`, or that with an offset.
enum RosTopic : std::uint8_t { ros_tick, ros_tip, ros_force };
inline constexpr std::size_t kRosTopics = 3;
[[nodiscard]] std::array<RosChannel, kRosTopics> ros_channels(std::size_t arm = 0);

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

 private:
  std::uint64_t ticks_a_view_;
  std::int64_t offset_ns_;
  std::string cdr_;
};

}  // namespace kerf
