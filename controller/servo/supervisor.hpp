// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/servo/servo.hpp"

namespace kerf {

/// Timing of the safety contract, in ticks of the plan's rate.
struct SafetyTiming {
  std::uint32_t hold_ticks = 5;        ///< a missing report holds the last force this long (5 ms),
  std::uint32_t zero_ticks = 20;       ///< then the force falls to zero by here (20 ms)
  std::uint32_t not_finite_ticks = 2;  ///< NaN for longer: motors off
  std::uint32_t fade_in_ticks = 100;   ///< after arming
  std::uint32_t rest_ticks = 50;       ///< parked at rest this long: calibrated (50 ms at least)

  std::uint32_t sparse_share = 20;  ///< see `sparse_ticks`

  /// Limit of a count of the ticks in which the force falls because reports are missing; each other
  /// tick reduces it by 1 / `sparse_share`. At the limit the fault latches. Twice `zero_ticks`: of
  /// gaps of 19 ms in a row the fourth latches, and a single gap is forgotten after 0.3 s. A device
  /// that reports every 7 ms latches after 0.4 s, one that reports within `hold_ticks` never.
  [[nodiscard]] constexpr std::uint32_t sparse_ticks() const noexcept { return 2 * zero_ticks; }
};

/// What the supervisor saw in this tick.
struct SafetyInputs {
  bool fresh = false;
  bool parked = false;      ///< as the device reports it
  bool calibrated = false;  ///< parked at rest for `rest_ticks`
  bool misplaced = false;   ///< parked at rest, at another pose than in its first calibration
  bool homed = true;        ///< the encoder counts are valid
  bool finite = true;
  bool overspeed = false;
};

/// State machine of the motors. They are on in `ramping` and `active` only; a fault latches until
/// the device has been parked at rest again.
///
///   off --report--> calibrating --rest--> armed --taken--> ramping --fade in--> active
///                     ^                   ^  ^                |                   |
///                     |                   |  '---- parked ----+-------------------+
///                     '---- homing lost --+-------------------+-------------------'
///                                         '-- rest -- fault <-- any fault, of either
///
/// The parked bit alone switches the motors off, but only parking at rest calibrates and clears a
/// fault, because one corrupt packet must do neither. Parking at rest at another pose than in the
/// first calibration is itself a fault: with a false parked bit, a calibration there would shift
/// the scene.
struct Supervisor {
  Phase phase = Phase::off;
  Fault fault = Fault::none;
  bool started = false;
  std::uint32_t stale_ticks = 0;
  std::uint32_t not_finite_ticks = 0;
  std::uint32_t fade_ticks = 0;
  std::uint32_t sparse = 0;  ///< ticks of falling force times `sparse_share`, less the others

  [[nodiscard]] constexpr bool motors_on() const noexcept {
    return phase == Phase::ramping || phase == Phase::active;
  }
};

/// Latches a fault, also one that is found only after the force was computed.
constexpr void latch(Fault fault, Supervisor& s) noexcept {
  s.fault = fault;
  s.phase = Phase::fault;
}

/// Counts a tick with motors on. Reports that arrive again and again just before the force is zero
/// would shake the hand.
constexpr void count_sparse(const SafetyTiming& timing, Supervisor& s) noexcept {
  if (s.stale_ticks > timing.hold_ticks) {
    s.sparse += timing.sparse_share;
  } else if (s.sparse > 0) {
    --s.sparse;
  }
}

/// One tick of the state machine. Bounded, no clock.
constexpr void supervise(const SafetyTiming& timing, const SafetyInputs& in,
                         Supervisor& s) noexcept {
  const auto one_more = [](std::uint32_t ticks) { return ticks + (ticks < UINT32_MAX ? 1U : 0U); };
  s.stale_ticks = in.fresh ? 0 : one_more(s.stale_ticks);
  s.not_finite_ticks = in.finite ? 0 : one_more(s.not_finite_ticks);

  if (in.fresh) {
    if (s.phase == Phase::off) s.phase = Phase::calibrating;
    if (!in.homed) {
      if (s.phase != Phase::fault) s.phase = Phase::calibrating;
      return;
    }
    if (in.parked) {
      if (in.calibrated) s.fault = Fault::none;
      if (in.calibrated) s.sparse = 0;
      if (in.calibrated || s.motors_on()) s.phase = Phase::armed;
      if (in.misplaced) latch(Fault::wrong_dock, s);
      return;
    }
    if (s.phase == Phase::armed) {
      s.phase = Phase::ramping;
      s.fade_ticks = 0;
      s.started = true;
    }
  }
  if (!s.motors_on()) return;
  count_sparse(timing, s);

  if (in.overspeed) {
    s.fault = Fault::overspeed;
  } else if (s.not_finite_ticks > timing.not_finite_ticks) {
    s.fault = Fault::not_finite;
  } else if (s.stale_ticks >= timing.zero_ticks) {
    s.fault = Fault::stale_input;
  } else if (s.sparse >= timing.sparse_ticks() * timing.sparse_share) {
    s.fault = Fault::sparse_input;
  }
  if (s.fault != Fault::none) {
    s.phase = Phase::fault;
    return;
  }
  if (s.phase == Phase::ramping && ++s.fade_ticks >= timing.fade_in_ticks) s.phase = Phase::active;
}

/// Ticks that the host skipped. What silence and a pose that is none may last is time, so that a
/// stall of the host makes neither longer.
constexpr void miss_ticks(std::uint32_t ticks, Supervisor& s) noexcept {
  const auto later = [ticks](std::uint32_t count) {
    return count + (ticks < UINT32_MAX - count ? ticks : UINT32_MAX - count);
  };
  s.stale_ticks = later(s.stale_ticks);
  if (s.not_finite_ticks > 0) s.not_finite_ticks = later(s.not_finite_ticks);
}

/// Starts the fade-in again, if the motors are on.
constexpr void restart_fade(Supervisor& s) noexcept {
  if (!s.motors_on()) return;
  s.phase = Phase::ramping;
  s.fade_ticks = 0;
}

/// Fraction of the held force that is left after `stale_ticks` without a report, as numerator over
/// `zero_ticks - hold_ticks`: all of it up to hold_ticks, none from zero_ticks on.
[[nodiscard]] constexpr std::uint32_t stale_fraction(const SafetyTiming& timing,
                                                     std::uint32_t stale_ticks) noexcept {
  if (stale_ticks <= timing.hold_ticks) return timing.zero_ticks - timing.hold_ticks;
  return stale_ticks >= timing.zero_ticks ? 0 : timing.zero_ticks - stale_ticks;
}

}  // namespace kerf
