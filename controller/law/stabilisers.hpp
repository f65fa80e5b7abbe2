// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "controller/law/law.hpp"
#include "shared/numeric/vec.hpp"

// The stabilisers that scenes can name: `passivity` and `energy_bounding`.

namespace kerf {

/// The stabiliser `passivity`: the passivity controller in the time domain of Hannaford and Ryu
/// (2002), at the port of the device (docs/forces.md 5.6).
///
/// It keeps an account of the energy that the loop took from the hand. If the account is below 0 it
/// damps along the motion so much that the account is 0 if the hand continues its last motion:
///
///   F -= a d,  a = min(deficit / d^2, m / T^2)
///
/// d is the motion in a tick. The account books the damping at once, so it only falls below
/// 0 by the bound of a; the port itself may, as the hand does not continue exactly so. In air a
/// surplus is dropped: energy taken by friction there would hide later activity. A deficit is kept,
/// and paid there as drag.
///
/// It uses the force that was really sent: damping that limits cut off is booked back.
template <class N>
class PassivityController {
 public:
  static constexpr const char* kName = "passivity";
  static constexpr const char* kMeaning =
      "passivity controller in the time domain: damps where the loop gave more than it took "
      "(docs/forces.md 5.6)";
  static constexpr std::array<LawSetting, 1> kSettings{
      {{"mass_kg", "kg", 0.001, 10, 0.045,
        "apparent mass of the device: the damping is at most this over the period"}}};
  using Real = typename N::Real;
  using Energy = typename N::Energy;
  using Vector = DeviceVec<Real>;

  struct State {
    bool begun = false;
    Energy taken_mj{};           ///< by the port, up to the last report
    Energy account_mj{};         ///< with the damping of the last tick already booked
    Energy promised_mj{};        ///< by that damping
    Vector wanted_n, motion_mm;  ///< in the last tick: without damping; expected in the next
  };

  explicit PassivityController(const LawSetup& setup)
      : most_n_per_mm_(
            static_cast<Real>(setup["mass_kg"] * setup.rate_hz() * setup.rate_hz() / 1000)) {}

  [[nodiscard]] Vector step(const StabiliserInput<N>& in, State& state) const noexcept {
    book(in, state);
    if (!in.contact) state.account_mj = std::min(state.account_mj, Energy(0));
    const auto ticks = static_cast<Real>(static_cast<double>(in.ticks));
    state.motion_mm = {in.moved_mm.x / ticks, in.moved_mm.y / ticks, in.moved_mm.z / ticks};
    state.wanted_n = in.wanted_n;
    const Vector damping_n = damping(state.account_mj, state.motion_mm);
    state.promised_mj = work_of_hand<N>(damping_n, state.motion_mm);
    state.account_mj = sum_of_energy<N>(state.account_mj, state.promised_mj);
    return in.wanted_n + damping_n;
  }

 private:
  /// Books the energy at the port since the last report.
  static void book(const StabiliserInput<N>& in, State& state) noexcept {
    const Energy port_mj = difference_of_energy<N>(in.taken_mj, state.taken_mj);
    state.taken_mj = in.taken_mj;
    if (!state.begun) {
      state.begun = true;
      return;
    }
    // Undoes the promised damping, and books the one that was really sent.
    Energy correction = difference_of_energy<N>(port_mj, state.promised_mj);
    if (in.ticks == 1 && state.promised_mj != Energy(0)) {
      const Vector added_n = in.sent_n - state.wanted_n;
      correction = difference_of_energy<N>(correction, work_of_hand<N>(added_n, in.moved_mm));
      correction = sum_of_energy<N>(correction, work_of_hand<N>(added_n, state.motion_mm));
    }
    state.account_mj = sum_of_energy<N>(state.account_mj, correction);
  }

  /// 0 without a deficit or without motion. Fixed rounds away from 0, so that no deficit is left.
  [[nodiscard]] Vector damping(Energy account_mj, Vector motion_mm) const noexcept {
    if (account_mj >= Energy(0)) return {};
    if constexpr (N::kIsFixed) {
      const auto square = [](Real x) {
        return static_cast<std::uint64_t>(std::int64_t{x.raw()} * x.raw());
      };
      const std::uint64_t moved = square(motion_mm.x) + square(motion_mm.y) + square(motion_mm.z);
      if (moved == 0) return {};
      constexpr std::int64_t kMost = (std::int64_t{1} << 46) - 1;  // 16 J
      const auto deficit = static_cast<std::uint64_t>(-std::max(account_mj, -kMost)) << 16;
      const auto rate = static_cast<std::int64_t>(
          std::min((deficit + moved - 1) / moved, std::uint64_t(most_n_per_mm_.raw())));
      const auto against = [&](Real x) {
        const std::int64_t wide = rate * x.raw();
        const std::int64_t up = ((wide < 0 ? -wide : wide) + 0xffff) >> 16;
        return Real::from_raw(saturate_i32(wide < 0 ? up : -up));
      };
      return {against(motion_mm.x), against(motion_mm.y), against(motion_mm.z)};
    } else {
      const Real moved = dot(motion_mm, motion_mm);
      if (!(moved > Real(0))) return {};
      return motion_mm * -std::min(-account_mj / moved, most_n_per_mm_);
    }
  }

  Real most_n_per_mm_;
};

/// The stabiliser `energy_bounding`: bounds the force by the energy that the next hold may give
/// (docs/forces.md 5.6), after the idea of Kim and Ryu (2010).
///
/// However the hand moves by d in the next tick, a force of F gives it F . d and the device's own
/// damping b takes at least b d^2 / T, so together they give at most F^2 T / (4 b). With the budget
/// E, the energy from the hand plus that taken by b,
///
///   |F| <= sqrt(4 b E / T)
///
/// keeps E from ever falling below 0, whatever makes the force. A spring is unchanged up to
/// K = 2 b / T, the passive limit of a sampled wall; a stiffer one is reduced to that. In air the
/// budget is the energy that b takes in one tick: earlier damping would hide later activity.
template <class N>
class EnergyBounding {
 public:
  static constexpr const char* kName = "energy_bounding";
  static constexpr const char* kMeaning =
      "bounds the force by what the hand put in and the device's damping takes "
      "(docs/forces.md 5.6)";
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
  /// Energy taken by b. By the estimated velocity, as the steps of an encoder are faster than the
  /// hand.
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
      const std::int64_t rate = std::max(n2_per_mj_.raw(), std::int32_t{1});
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
