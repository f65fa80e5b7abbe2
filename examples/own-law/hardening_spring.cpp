// SPDX-License-Identifier: Apache-2.0
// A coupling that hardens: F = K d + H d^3 along a spring of length d, with kerf's damper.
#include <kerf/law.hpp>

template <class N>
class HardeningSpring {
 public:
  using Real = typename N::Real;
  using Ratio = typename N::Ratio;

  static constexpr const char* kName = "hardening_spring";
  static constexpr const char* kMeaning = "a spring with a cubic part: K d + H d^3";
  static constexpr std::array<kerf::LawSetting, 3> kSettings{{
      {"stiffness_n_per_mm", "N/mm", 0, 10, 0.2, "K, of a short spring"},
      {"hardening_n_per_mm3", "N/mm^3", 0, 10, 0.005, "H"},
      {"damping_ns_per_mm", "N s/mm", 0, 0.1, 0.002, "along the spring"},
  }};
  struct State {};  // no memory

  explicit HardeningSpring(const kerf::LawSetup& setup)
      : k_(Ratio(setup["stiffness_n_per_mm"])),
        h_(Real(setup["hardening_n_per_mm3"])),
        b_(typename N::Unit(setup["damping_ns_per_mm"])) {}

  [[nodiscard]] kerf::DeviceVec<Real> step(const kerf::ForceInput<N>& in, State&) const noexcept {
    const Real d = norm(in.spring_mm);
    const kerf::VirtualCoupling<N> now{k_ + Ratio(h_ * d * d), b_};
    return kerf::virtual_coupling_force(now, in.spring_mm, in.velocity_mm_per_s);
  }

 private:
  Ratio k_;
  Real h_;
  typename N::Unit b_;
};
KERF_REGISTER_FORCE_LAW(HardeningSpring)
