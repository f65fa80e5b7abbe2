// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "controller/law/stabiliser.hpp"
#include "controller/law/work_of_hand.hpp"
#include "shared/numeric/clamped.hpp"

namespace kerf {

/// The stabiliser `energy_bounding`: no force is larger than what the next hold may give away
/// (docs/theory.md 5.6), after the idea of Kim and Ryu (2010).
///
/// However the hand moves by d in the next tick, a force of F gives it F . d and the device's own
/// damping b takes at least b d^2 / T, so together they give at most F^2 T / (4 b). With the budget
/// E, what the hand put in and what b took of it,
///
///   |F| <= sqrt(4 b E / T)
///
/// keeps E from ever falling below 0, whatever makes the force. A spring is not touched up to
/// K = 2 b / T, the passive limit of a sampled wall; a stiffer one is felt as that. In the air the
/// budget is what b takes in one tick: what it took on the way there would hide later activity.
template <class N>
class EnergyBounding {
 public:
  static constexpr const char* kName = "energy_bounding";
  static constexpr const char* kMeaning =
      "bounds the force by what the hand put in and the device's damping takes "
      "(docs/theory.md 5.6)";
  static constexpr std::array<LawSetting, 1> kSettings{
      {{"damping_ns_per_mm", "N s/mm", 1e-6, 0.1, 0.0002,
        "viscous damping of the device's own; no more than it really has"}}};
  using Real = typename N::Real;
  using Energy = typename N::Energy;
  using Vector = DeviceVec<Real>;

  struct State {
    bool begun = false;
    Energy taken_mj{};   ///< by the port, up to the last report
    Energy budget_mj{};  ///< E
  };

  explicit EnergyBounding(const LawSetup& setup)
      : damping_ns_per_mm_(static_cast<typename N::Unit>(setup["damping_ns_per_mm"])),
        n2_per_mj_(static_cast<Real>(4 * setup["damping_ns_per_mm"] * setup.rate_hz())) {}

  [[nodiscard]] Vector step(const StabiliserInput<N>& in, State& state) const noexcept {
    const Energy port_mj = difference_of_energy<N>(in.taken_mj, state.taken_mj);
    const Energy damped_mj = damped(in);
    state.taken_mj = in.taken_mj;
    if (state.begun) {
      state.budget_mj = sum_of_energy<N>(state.budget_mj, sum_of_energy<N>(port_mj, damped_mj));
    }
    state.begun = true;
    if (!in.contact) state.budget_mj = std::min(state.budget_mj, damped_mj);
    return clamped(in.wanted_n, bound(state.budget_mj));
  }

 private:
  /// What b takes. By the estimated velocity, as an encoder's steps are faster than the hand.
  [[nodiscard]] Energy damped(const StabiliserInput<N>& in) const noexcept {
    const auto force = [&](Real v) { return multiply<Real>(damping_ns_per_mm_, v); };
    const Vector v = in.velocity_mm_per_s;
    return std::max(Energy(0), difference_of_energy<N>(
                                   Energy(0), work_of_hand<N>({force(v.x), force(v.y), force(v.z)},
                                                              in.moved_mm)));
  }

  [[nodiscard]] Real bound(Energy budget_mj) const noexcept {
    if (!(budget_mj > Energy(0))) return Real(0);
    if constexpr (N::kIsFixed) {
      const std::int64_t rate = std::max(n2_per_mj_.raw(), 1);
      const std::int64_t square = std::min(budget_mj, INT64_MAX / rate) * rate >> 16;
      return Real::from_raw(saturate_i32(integer_sqrt(static_cast<std::uint64_t>(square))));
    } else {
      return square_root(n2_per_mj_ * budget_mj);
    }
  }

  typename N::Unit damping_ns_per_mm_;
  Real n2_per_mj_;
};

}  // namespace kerf
