// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "controller/law/velocity_estimators.hpp"
#include "controller/law/virtual_coupling.hpp"
#include "controller/servo/energy_ledger.hpp"
#include "controller/servo/force_limits.hpp"
#include "lab/stability/axes.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf::zwidth {

/// The wall's side of the loop: from a reading to a force, once per tick. Along y, as the servo's.
template <class N>
class OneAxisWall {
 public:
  using Real = typename N::Real;

  OneAxisWall(const LoopCase& subject, double stiffness_n_per_mm, double tip_mm)
      : law_(subject.law),
        limits_on_(subject.limits),
        coupling_{typename N::Ratio(stiffness_n_per_mm),
                  typename N::Unit(subject.damping_ns_per_mm)},
        last_mm_(Real(tip_mm)) {
    const double period_s = subject.loop.period_s;
    // Half a step, as plan_device.hpp: a reading shows the lower end of its step, always as far
    // off.
    const LawLoop loop{.rate_hz = std::round(1 / period_s),
                       .tip_noise_mm = subject.loop.quantum_mm / 2};
    velocity_plan_ = plan_law<VelocityInput, N>(subject.estimator, loop);
    force_plan_ = plan_law<ForceInput, N>(force_law_at(subject, stiffness_n_per_mm), loop);
    stabiliser_plan_ = plan_law<StabiliserInput, N>(subject.stabiliser, loop);
    const LimitSettings scene;
    limits_ = {.peak_n = Real(scene.force_n),
               .continuous_n = Real(scene.force_n),  // the motors stay cool
               .slew_n_per_tick = Real(scene.slew_n_per_ms * 1000 * period_s),
               .thermal_per_tick = {}};
  }

  /// The force on the tip, outwards positive, that a reading of `tip_mm` asks for; NaN if the law
  /// failed.
  double force(double reading_mm) noexcept {
    const auto tip_mm = Real(reading_mm);
    const Real moved_mm = tip_mm - last_mm_;
    last_mm_ = tip_mm;
    absorb(moved_mm);
    velocity_ = velocity_plan_(velocity_memory_, {along(tip_mm), 1, !velocity_memory_.begun});
    const bool touches = tip_mm < Real(0);
    DeviceVec<Real> wanted_n{};
    if (law_ == Law::two_sided || touches) {
      const LawForce<Real> force = wanted(tip_mm);
      if (force.has_failed) return std::numeric_limits<double>::quiet_NaN();
      wanted_n = force;
    }
    sent_n_ = steadied(wanted_n, moved_mm, touches);
    return static_cast<double>(sent_n_.y);
  }

 private:
  static DeviceVec<Real> along(Real y) noexcept { return {Real(0), y, Real(0)}; }

  /// The loop's work on the hand, as the servo's account has it.
  void absorb(Real moved_mm) noexcept {
    if constexpr (N::kIsFixed) {
      taken_mj_ = saturating_add(taken_mj_, -(std::int64_t{sent_n_.y.raw()} * moved_mm.raw()));
    } else {
      taken_mj_ -= sent_n_.y * moved_mm;
    }
  }

  LawForce<Real> wanted(Real tip_mm) noexcept {
    const Real spring_mm = Real(0) - tip_mm;
    if (law_ == Law::coupling)
      return virtual_coupling_force(coupling_, along(spring_mm), velocity_);
    if (law_ == Law::own) {
      using Unit = typename N::Unit;
      return force_plan_(force_memory_, {along(tip_mm),
                                         {Real(0), tip_mm, Real(0)},
                                         velocity_,
                                         along(spring_mm),
                                         {Unit(0), Unit(1), Unit(0)}});
    }
    const Real push_n = multiply<Real>(coupling_.stiffness_n_per_mm, spring_mm) -
                        multiply<Real>(coupling_.damping_ns_per_mm, velocity_.y);
    return along(law_ == Law::linear ? std::max(Real(0), push_n) : push_n);
  }

  /// Limits and stabiliser, in the order of the servo step.
  DeviceVec<Real> steadied(DeviceVec<Real> wanted_n, Real moved_mm, bool touches) noexcept {
    const bool leaves = sent_n_.y * moved_mm > Real(0);
    const auto limited = [&](DeviceVec<Real> force_n, ThermalState<N>& thermal) {
      return limits_on_ ? limited_force(limits_, thermal, force_n, sent_n_, leaves) : force_n;
    };
    if (!stabiliser_plan_.given()) return limited(wanted_n, thermal_);
    ThermalState<N> heated = thermal_;
    const DeviceVec<Real> limited_n = limited(wanted_n, heated);
    const DeviceVec<Real> steady_n =
        stabiliser_plan_(stabiliser_memory_,
                         {limited_n, sent_n_, along(moved_mm), 1, velocity_, taken_mj_, touches});
    if (!(steady_n == limited_n)) return limited(steady_n, thermal_);
    thermal_ = heated;
    return limited_n;
  }

  Law law_;
  bool limits_on_;
  VirtualCoupling<N> coupling_;
  Real last_mm_;
  VelocityEstimatorPlan<N> velocity_plan_;
  ForceLawPlan<N> force_plan_;
  StabiliserPlan<N> stabiliser_plan_;
  LawMemory velocity_memory_, force_memory_, stabiliser_memory_;
  ForceLimits<N> limits_{};
  ThermalState<N> thermal_;
  DeviceVec<Real> velocity_{}, sent_n_{};
  typename N::Energy taken_mj_{};
};

}  // namespace kerf::zwidth
