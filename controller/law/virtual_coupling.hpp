// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "controller/law/law.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// The virtual coupling between hand and proxy at the device port (docs/forces.md 5.1): the only
/// stiff element of the loop, since the proxy has no mass.
template <class N>
struct VirtualCoupling {
  typename N::Ratio stiffness_n_per_mm{};
  typename N::Unit damping_ns_per_mm{};
};

/// The damper grows with the spring (Hunt and Crossley 1975) and is full at this length, so that a
/// fast first contact causes no force step.
inline constexpr double kFullDampingMm = 0.1;

/// F = u max(0, K delta - B min(1, delta / kFullDampingMm) v . u). `spring_mm` leads from the hand
/// to the proxy, delta is its length, u its direction; v is the hand's velocity in mm/s. Only
/// motion along the spring is damped: a tool that slides has no drag, and a hand that leaves is not
/// held back.
///
/// Fixed: saturates at the ends of the range; a spring shorter than 2^-16 mm gives nothing.
template <class N>
[[nodiscard]] constexpr DeviceVec<typename N::Real> virtual_coupling_force(
    const VirtualCoupling<N>& coupling, DeviceVec<typename N::Real> spring_mm,
    DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  const Real length_mm = norm(spring_mm);
  if (!(length_mm > Real(0))) return {};

  const auto along = [&](Real spring, Real velocity) {
    return multiply<Real>(Unit(spring / length_mm), velocity);
  };
  const Real outward_mm_per_s = along(spring_mm.x, velocity_mm_per_s.x) +
                                along(spring_mm.y, velocity_mm_per_s.y) +
                                along(spring_mm.z, velocity_mm_per_s.z);
  const Real grown = std::min(Real(1), length_mm * Real(1 / kFullDampingMm));
  const Real push_n = multiply<Real>(coupling.stiffness_n_per_mm, length_mm) -
                      grown * multiply<Real>(coupling.damping_ns_per_mm, outward_mm_per_s);
  if (!(push_n > Real(0))) return {};

  const auto component = [&](Real spring) {
    if constexpr (N::kIsFixed) {
      // One rounding: |spring| <= length + 1, so the quotient stays near push.
      return Real::from_raw(
          saturate_i32(std::int64_t{spring.raw()} * push_n.raw() / length_mm.raw()));
    } else {
      return spring / length_mm * push_n;
    }
  };
  return {component(spring_mm.x), component(spring_mm.y), component(spring_mm.z)};
}

/// The virtual coupling as a force law. Its spring stores what it gives without the damper. The
/// keys of a scene have ranges of their own.
template <class N>
class CouplingLaw {
  using Real = typename N::Real;
  using Unit = typename N::Unit;

 public:
  static constexpr const char* kName = "coupling";
  static constexpr const char* kMeaning = "a spring, and a damper that grows with it";
  static constexpr std::array<LawSetting, 2> kSettings{{
      {"stiffness_n_per_mm", "N/mm", 0, 1e6, 0.4, "K"},
      {"damping_ns_per_mm", "N s/mm", 0, 1e6, 0.002, "B, along the spring"},
  }};
  struct State {};

  explicit CouplingLaw(const LawSetup& setup) noexcept
      : coupling_{typename N::Ratio(setup["stiffness_n_per_mm"]),
                  Unit(setup["damping_ns_per_mm"])} {}

  [[nodiscard]] LawForce<Real> step(const ForceInput<N>& in, State& /*none*/) const noexcept {
    const auto force_n = virtual_coupling_force(coupling_, in.spring_mm, in.velocity_mm_per_s);
    if (coupling_.damping_ns_per_mm == Unit{}) return force_n;
    return {force_n,
            virtual_coupling_force<N>({coupling_.stiffness_n_per_mm, {}}, in.spring_mm, {})};
  }

 private:
  VirtualCoupling<N> coupling_;
};

}  // namespace kerf
