// SPDX-License-Identifier: Apache-2.0
// Further laws for the test own_law, one of each kind, for a what-if with another one.
#include <kerf/law.hpp>

template <class N>
class HalfSpring {
 public:
  using Real = typename N::Real;
  static constexpr const char* kName = "half_spring";
  static constexpr const char* kMeaning = "half a newton for each mm";
  static constexpr std::array<kerf::LawSetting, 0> kSettings{};
  struct State {};

  explicit HalfSpring(const kerf::LawSetup&) {}
  [[nodiscard]] kerf::DeviceVec<Real> step(const kerf::ForceInput<N>& in, State&) const noexcept {
    const Real half(0.5);
    return {in.spring_mm.x * half, in.spring_mm.y * half, in.spring_mm.z * half};
  }
};
KERF_REGISTER_FORCE_LAW(HalfSpring)

template <class N>
class StandingHand {
 public:
  static constexpr const char* kName = "standing_hand";
  static constexpr const char* kMeaning = "the hand never moves";
  static constexpr std::array<kerf::LawSetting, 0> kSettings{};
  struct State {};

  explicit StandingHand(const kerf::LawSetup&) {}
  [[nodiscard]] auto step(const kerf::VelocityInput<N>&, State&) const noexcept {
    return kerf::DeviceVec<typename N::Real>{};
  }
};
KERF_REGISTER_VELOCITY_ESTIMATOR(StandingHand)

template <class N>
class NoForce {
 public:
  static constexpr const char* kName = "no_force";
  static constexpr const char* kMeaning = "nothing is sent";
  static constexpr std::array<kerf::LawSetting, 0> kSettings{};
  struct State {};

  explicit NoForce(const kerf::LawSetup&) {}
  [[nodiscard]] auto step(const kerf::StabiliserInput<N>&, State&) const noexcept {
    return kerf::DeviceVec<typename N::Real>{};
  }
};
KERF_REGISTER_STABILISER(NoForce)
