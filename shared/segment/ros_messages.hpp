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

inline constexpr std::string_view kRosEncoding = "cdr";            ///< of the messages
inline constexpr std::string_view kRosSchemaEncoding = "ros2msg";  ///< of their definitions

/// A topic, and what its messages are.
struct RosChannel {
  std::string_view topic;
  std::string_view schema;  ///< name of the message's type
  std::string definition;   ///< of the type and of all that it consists of
};

/// The channels of a run, each known by its place in `ros_channels`:
///
///     /kerf/tick    kerf_msgs/msg/Tick              every column of docs/log.md, in their order
///     /kerf/tip     geometry_msgs/msg/PoseStamped   the tool's tip in metres, in frame "scene"
///     /kerf/force   geometry_msgs/msg/WrenchStamped the commanded force in frame "device"
///
/// Of the second arm: /kerf/2/tick, /kerf/2/tip, /kerf/2/force, with frame "device_2". Stamps are
/// `start_ns`.
enum RosTopic : std::uint8_t { ros_tick, ros_tip, ros_force, kRosTopics };
[[nodiscard]] std::array<RosChannel, kRosTopics> ros_channels(std::size_t arm = 0);

/// The messages of a run whose ticks take `tick_ns`.
class RosMessages {
 public:
  explicit RosMessages(std::uint64_t tick_ns) noexcept;

  /// Whether a tick has a message of this topic. Tip and force are sent only 100 times a second,
  /// because the messages of `ros_tick` have all values. There is no tip before docking.
  [[nodiscard]] bool has(RosTopic topic, const TickRecord& record) const noexcept;
  /// The message, of an arm's record; valid until the next call.
  [[nodiscard]] std::string_view message(RosTopic topic, const TickRecord& record,
                                         std::size_t arm = 0);

 private:
  std::uint64_t ticks_a_view_;
  std::string cdr_;
};

}  // namespace kerf
