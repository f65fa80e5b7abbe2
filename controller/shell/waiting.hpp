// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/servo/device_report.hpp"
#include "controller/servo/servo_output.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// What a device without force waits for, in the order in which a user does it.
enum class Waiting : std::uint8_t {
  nothing,  ///< its force is on
  report,   ///< its first word
  homing,   ///< its encoders have no meaning yet
  parked,   ///< never parked yet, or a fault is to be forgiven
  rest,     ///< parked, but it moves
  hand      ///< calibrated and parked: to be taken
};

/// After a tick. Bounded, no clock: for the servo thread.
[[nodiscard]] Waiting waiting_for(const DeviceReport& report, const ServoOutput& output) noexcept;

/// What the user does about it, such as "rest the stylus in the inkwell"; empty for `nothing`.
[[nodiscard]] const char* deed_for(Personality personality, Waiting waiting) noexcept;

/// Both on one line, such as "waiting until parked: rest the stylus in the inkwell".
[[nodiscard]] std::string text_of(Personality personality, Waiting waiting);

/// What a program is at while the device at `port` has not answered yet.
[[nodiscard]] std::string text_before_device(const std::string& port);

/// The line of one that was asked to end while it was at `work`, before there was a device.
void tell_stopped_early(const std::string& work);

/// Decides when a wait is worth a line: when it has lasted for a second, by the clock and in ticks,
/// and each kind once until the force comes on. In lock-step ticks may wait for pictures or for a
/// busy machine, and no user can do anything about that. One thread.
class WaitTeller {
 public:
  /// Call several times a second. Whether to tell of `now`. `servo_ns`: ticks so far, as time.
  [[nodiscard]] bool look(Waiting now, std::int64_t now_ns, std::int64_t servo_ns) noexcept;

 private:
  Waiting last_ = Waiting::nothing;
  std::int64_t since_ns_ = 0;
  std::int64_t since_servo_ns_ = 0;
  std::uint32_t told_ = 0;  ///< one bit for each kind
};

}  // namespace kerf
