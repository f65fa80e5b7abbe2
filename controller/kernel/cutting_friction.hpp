// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/decay.hpp"
#include "controller/kernel/surface_drag.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// What the turning tool's surface does to hand and spindle: F_t = mu F_n against omega x arm
/// (docs/theory.md 6.5). Made by `cutting_friction`.
template <class N>
struct FrictionPlan {
  typename N::Real coefficient{};  ///< F_t / F_n
  typename N::Unit approach{};     ///< of the low-pass: share of the difference made up in a tick
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

  /// A contact of `normal_force_n` whose surface moves as `drag` says.
  constexpr void add(const FrictionPlan<N>& plan, Real normal_force_n,
                     const SurfaceDrag<N>& drag) noexcept {
    const Real friction_n = plan.coefficient * normal_force_n;
    const Real x(drag.x), z(drag.z);
    const Real length = std::max(norm(Vec<Real, ToolSpace>{x, Real(0), z}), Real(1));
    // Against the motion: what the tooth does to the tool.
    force_n_ = force_n_ - Vec<Real, ToolSpace>{x / length, Real(0), z / length} * friction_n;
    rims_n_ += friction_n * Real(drag.arm);
  }

  [[nodiscard]] constexpr Vec<Real, ToolSpace> force_n() const noexcept { return force_n_; }
  /// About the tool's axis, to be carried by the spindle.
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
