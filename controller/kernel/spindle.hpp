// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/milling.hpp"
#include "controller/kernel/surface_motion.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// The motor of the tool, and the friction of the rotating tool on hand and spindle.

namespace kerf {

/// The motor of the tool (docs/forces.md 6.5): I d(omega)/dt = tau_motor - tau_load, with
/// the straight line of a turbine, tau_motor = tau_stall (1 - omega / omega_free). Constant during
/// a run; made by `spindle_plan`.
template <class N>
struct SpindlePlan {
  typename N::Unit free_ratio{};      ///< omega_free / omega_ref, below 2
  typename N::Real loads_per_n_mm{};  ///< 1 / tau_stall
  typename N::Unit
      approach{};  ///< fraction of the difference to the steady speed made up in a tick
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
  /// Torque over the stall torque, 0..kMaxSpindleLoad; from 1 on the spindle stalls.
  typename N::Real load{};
};

inline constexpr int kMaxSpindleLoad = 100;  ///< larger loads are clamped to it

/// One tick under a torque >= 0. The speed approaches omega_free (1 - load), the equilibrium of
/// motor and load, and stays at 0 if the load exceeds the stall torque: friction brakes and never
/// reverses the rotation. Switched off, the spindle stops as fast as it runs up.
///
/// Fixed: the speed settles within 2^-31 / `approach` of the equilibrium. Servo thread.
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

/// Friction of the rotating tool on hand and spindle: F_t = mu F_n against omega x lever
/// (docs/forces.md 6.5). Made by `cutting_friction`.
template <class N>
struct FrictionPlan {
  typename N::Real coefficient{};  ///< F_t / F_n
  typename N::Unit approach{};  ///< of the low-pass: fraction of the difference made up in a tick
};

/// Time constant of the low-pass, 32 Hz: slower than the steps that single voxels make, faster than
/// a hand can follow.
inline constexpr double kFrictionSmoothingS = 0.005;

template <class N>
[[nodiscard]] FrictionPlan<N> friction_plan(double coefficient, double tick_s) {
  return {typename N::Real(coefficient), typename N::Unit(decay(tick_s / kFrictionSmoothingS))};
}

/// Friction of one tick, added up over the volumes that the tool touches.
template <class N>
class CuttingFriction {
 public:
  using Real = typename N::Real;

  /// A contact with `normal_force_n`, at which the surface moves by `drag`.
  constexpr void add(const FrictionPlan<N>& plan, Real normal_force_n,
                     const SurfaceDrag<N>& drag) noexcept {
    const Real friction_n = plan.coefficient * normal_force_n;
    const Real x(drag.x), z(drag.z);
    const Real length = std::max(norm(Vec<Real, ToolSpace>{x, Real(0), z}), Real(1));
    // Against the motion: the force of the tooth on the tool.
    force_n_ = force_n_ - Vec<Real, ToolSpace>{x / length, Real(0), z / length} * friction_n;
    rims_n_ += friction_n * Real(drag.lever_ratio);
  }

  [[nodiscard]] constexpr Vec<Real, ToolSpace> force_n() const noexcept { return force_n_; }
  /// Torque about the axis of the tool, which the spindle carries.
  [[nodiscard]] constexpr Real torque_n_mm(Real rim_mm) const noexcept { return rims_n_ * rim_mm; }

 private:
  Vec<Real, ToolSpace> force_n_;
  Real rims_n_{};
};

/// The force on the hand: `wanted` through the low-pass whose state is `felt_n`. Never longer than
/// the longest force wanted so far; fixed: rests within 2^-17 / `approach` N of it.
template <class N>
constexpr void follow_friction(const FrictionPlan<N>& plan,
                               Vec<typename N::Real, ToolSpace> wanted_n,
                               Vec<typename N::Real, ToolSpace>& felt_n) noexcept {
  const auto toward = [&](typename N::Real from, typename N::Real to) {
    return from + multiply<typename N::Real>(to - from, plan.approach);
  };
  felt_n = {toward(felt_n.x, wanted_n.x), toward(felt_n.y, wanted_n.y),
            toward(felt_n.z, wanted_n.z)};
}

}  // namespace kerf
