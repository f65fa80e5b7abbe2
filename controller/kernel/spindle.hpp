// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/decay.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

/// The motor that turns the tool (docs/theory.md 6.5): I d(omega)/dt = tau_motor - tau_load, with
/// the straight line of a turbine, tau_motor = tau_stall (1 - omega / omega_free). Constant during
/// a run; made by `spindle_plan`.
template <class N>
struct SpindlePlan {
  typename N::Unit free_ratio{};      ///< omega_free / omega_ref, below 2
  typename N::Real loads_per_n_mm{};  ///< 1 / tau_stall
  typename N::Unit approach{};  ///< share of the difference to the resting speed made up in a tick
};

/// `free_ratio` 0..1.9, positive torque in N mm; `run_up_s` = I omega_free / tau_stall is the time
/// constant. A tick makes up 1 - exp(-T / run_up) of the difference, so the speed after a given
/// time is the same at every rate. Load time.
template <class N>
[[nodiscard]] SpindlePlan<N> spindle_plan(double free_ratio, double stall_torque_n_mm,
                                          double run_up_s, double tick_s) {
  using Unit = typename N::Unit;
  return {Unit(free_ratio), typename N::Real(1 / stall_torque_n_mm),
          Unit(decay(tick_s / run_up_s))};
}

template <class N>
struct SpindleState {
  typename N::Unit ratio{};  ///< omega / omega_ref; 0 before it is switched on
  typename N::Real
      load{};  ///< torque over the stall torque, 0..kMaxSpindleLoad; from 1 on it stalls
};

inline constexpr int kMaxSpindleLoad = 100;  ///< a larger load counts as that

/// One tick under a torque >= 0. The speed goes to omega_free (1 - load), where motor and load
/// agree, and stays at 0 when the load is more than the motor has: friction brakes, it does not
/// turn back. Switched off, the spindle is braked as fast as it runs up.
///
/// Fixed: the speed rests within 2^-31 / `approach` of where it should. Servo thread.
template <class N>
constexpr void turn_spindle(const SpindlePlan<N>& plan, bool on, typename N::Real torque_n_mm,
                            SpindleState<N>& state) noexcept {
  using Unit = typename N::Unit;
  using Real = typename N::Real;
  state.load = std::min(torque_n_mm * plan.loads_per_n_mm, Real(kMaxSpindleLoad));
  Unit resting{};
  if (on && state.load < Real(1)) resting = plan.free_ratio * Unit(Real(1) - state.load);
  state.ratio += (resting - state.ratio) * plan.approach;
}

}  // namespace kerf
