// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/servo/servo_output.hpp"

namespace kerf {

/// Timing of the safety contract, in ticks of the plan's rate.
struct SafetyTiming {
  std::uint32_t hold_ticks = 5;        ///< a missing report holds the last force this long (5 ms),
  std::uint32_t zero_ticks = 20;       ///< then the force falls to zero by here (20 ms)
  std::uint32_t not_finite_ticks = 2;  ///< NaN for longer: motors off
  std::uint32_t fade_in_ticks = 100;   ///< after arming
  std::uint32_t dock_ticks = 50;       ///< at rest in the inkwell this long: calibrated (50 ms)
};

/// What the supervisor saw in this tick.
struct SafetyInputs {
  bool fresh = false;
  bool docked = false;      ///< the device says so in this report
  bool calibrated = false;  ///< and has rested there for `dock_ticks`
  bool finite = true;
  bool overspeed = false;
};

/// State machine in front of the motors. Motors are on only while it says so; a fault latches until
/// the stylus has been at rest in the inkwell again.
///
///   calibrating --rest--> docked --left inkwell--> ramping --fade in--> active
///                           ^------------ docked ------------'            |
///                           '--- rest -- fault <------- any fault --------'
///
/// The docked bit alone switches the motors off, but only rest calibrates and clears: one corrupt
/// packet must neither move the tip nor forgive a fault.
struct Supervisor {
  Phase phase = Phase::calibrating;
  Fault fault = Fault::none;
  bool armed = false;
  std::uint32_t stale_ticks = 0;
  std::uint32_t not_finite_ticks = 0;
  std::uint32_t fade_ticks = 0;

  [[nodiscard]] constexpr bool motors_on() const noexcept {
    return phase == Phase::ramping || phase == Phase::active;
  }
};

/// One tick of the state machine. Bounded, no clock.
constexpr void supervise(const SafetyTiming& timing, const SafetyInputs& in,
                         Supervisor& s) noexcept {
  s.stale_ticks = in.fresh ? 0 : s.stale_ticks + (s.stale_ticks < UINT32_MAX ? 1U : 0U);
  s.not_finite_ticks =
      in.finite ? 0 : s.not_finite_ticks + (s.not_finite_ticks < UINT32_MAX ? 1U : 0U);

  if (in.fresh && in.docked) {
    if (in.calibrated) s.fault = Fault::none;
    if (in.calibrated || s.motors_on()) s.phase = Phase::docked;
    return;
  }
  if (s.phase == Phase::docked && in.fresh) {
    s.phase = Phase::ramping;
    s.fade_ticks = 0;
    s.armed = true;
  }
  if (!s.motors_on()) return;

  if (in.overspeed) {
    s.fault = Fault::overspeed;
  } else if (s.not_finite_ticks > timing.not_finite_ticks) {
    s.fault = Fault::not_finite;
  } else if (s.stale_ticks >= timing.zero_ticks) {
    s.fault = Fault::stale_input;
  }
  if (s.fault != Fault::none) {
    s.phase = Phase::fault;
    return;
  }
  if (s.phase == Phase::ramping && ++s.fade_ticks >= timing.fade_in_ticks) s.phase = Phase::active;
}

/// Latches a fault that shows only after the force was computed.
constexpr void latch(Fault fault, Supervisor& s) noexcept {
  s.fault = fault;
  s.phase = Phase::fault;
}

/// Fades the force in again, where it was in.
constexpr void restart_fade(Supervisor& s) noexcept {
  if (!s.motors_on()) return;
  s.phase = Phase::ramping;
  s.fade_ticks = 0;
}

/// Share of the held force that is left after `stale_ticks` without a report, as numerator over
/// `zero_ticks - hold_ticks`: all of it up to hold_ticks, none from zero_ticks on.
[[nodiscard]] constexpr std::uint32_t stale_share(const SafetyTiming& timing,
                                                  std::uint32_t stale_ticks) noexcept {
  if (stale_ticks <= timing.hold_ticks) return timing.zero_ticks - timing.hold_ticks;
  return stale_ticks >= timing.zero_ticks ? 0 : timing.zero_ticks - stale_ticks;
}

}  // namespace kerf
