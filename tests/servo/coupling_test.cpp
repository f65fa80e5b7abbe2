// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/law/virtual_coupling.hpp"
#include "controller/scene/scene.hpp"

namespace kerf::coupling_test {
namespace {

template <class N>
VirtualCoupling<N> coupling(double stiffness_n_per_mm = 0.4, double damping_ns_per_mm = 0.002) {
  return {typename N::Ratio(stiffness_n_per_mm), typename N::Unit(damping_ns_per_mm)};
}

template <class N>
DeviceVec<typename N::Real> vec(double x, double y, double z) {
  using Real = typename N::Real;
  return {Real(x), Real(y), Real(z)};
}

}  // namespace

TEST_CASE_TEMPLATE("at rest the coupling is a spring", N, FixedNumbers, DoubleNumbers) {
  const auto force = virtual_coupling_force(coupling<N>(), vec<N>(0.5, -1, 0.25), vec<N>(0, 0, 0));
  CHECK(double(force.x) == doctest::Approx(0.2).epsilon(1e-3));
  CHECK(double(force.y) == doctest::Approx(-0.4).epsilon(1e-3));
  CHECK(double(force.z) == doctest::Approx(0.1).epsilon(1e-3));
}

TEST_CASE_TEMPLATE("only motion along the spring is damped, and a hand that leaves is never pulled",
                   N, FixedNumbers, DoubleNumbers) {
  const auto force_n = [](double x, double y, double z) {
    const auto force = virtual_coupling_force(coupling<N>(), vec<N>(0, 1, 0), vec<N>(x, y, z));
    CHECK(force.x == typename N::Real(0));
    return double(force.y);
  };
  CHECK(force_n(300, 0, -500) == doctest::Approx(0.4).epsilon(1e-3));
  CHECK(force_n(0, -50, 0) == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(force_n(0, 50, 0) == doctest::Approx(0.3).epsilon(1e-3));
  CHECK(force_n(0, 1000, 0) == 0);
}

TEST_CASE_TEMPLATE("a hand that arrives fast feels no blow", N, FixedNumbers, DoubleNumbers) {
  const auto touch =
      virtual_coupling_force(coupling<N>(), vec<N>(0, 0.001, 0), vec<N>(0, -1000, 0));
  CHECK(double(touch.y) > 0.0);
  CHECK(double(touch.y) < 0.03);
}

TEST_CASE_TEMPLATE("both ends of what a scene may say give a force in the spring's direction", N,
                   FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  constexpr double kFar = 32767;
  for (const double stiffness : {kMinStiffnessNPerMm, 1.0, kMaxStiffnessNPerMm}) {
    for (const double damping : {0.0, kMaxDampingNsPerMm}) {
      const auto gains = coupling<N>(stiffness, damping);
      CHECK(double(gains.stiffness_n_per_mm) == doctest::Approx(stiffness).epsilon(1e-4));
      CHECK(double(gains.damping_ns_per_mm) == doctest::Approx(damping));
      for (const double spring : {-kFar, -1.0, -0.01, 0.0, 0.01, 1.0, kFar}) {
        for (const double velocity : {-kFar, -1.0, 0.0, 1.0, kFar}) {
          CAPTURE(stiffness);
          CAPTURE(damping);
          CAPTURE(spring);
          CAPTURE(velocity);
          const auto force = virtual_coupling_force(gains, vec<N>(spring, spring, -spring),
                                                    vec<N>(velocity, -velocity, velocity));
          for (const Real component : {force.x, force.y, force.z}) {
            CHECK(std::isfinite(double(component)));
          }
          CHECK(double(force.x) * spring >= 0);
          CHECK(double(force.y) * spring >= 0);
          CHECK(double(force.z) * spring <= 0);
        }
      }
    }
  }
  // Fixed: stays at the end of its range, where double goes on.
  const auto most = virtual_coupling_force(coupling<N>(kMaxStiffnessNPerMm, 0), vec<N>(0, kFar, 0),
                                           vec<N>(0, 0, 0));
  if constexpr (N::kIsFixed) {
    CHECK(double(most.y) == doctest::Approx(32768).epsilon(1e-4));
  } else {
    CHECK(double(most.y) == doctest::Approx(kFar * kMaxStiffnessNPerMm));
  }
}

TEST_CASE("fixed follows double, and no input makes it point the wrong way") {
  CHECK(rc::check([](std::array<std::int32_t, 6> raw) {
    const auto at = [&](std::size_t i) {
      return DeviceVec<Q16>{Q16::from_raw(raw[i]), Q16::from_raw(raw[i + 1]),
                            Q16::from_raw(raw[i + 2])};
    };
    const auto exact = [](DeviceVec<Q16> v) {
      return DeviceVec<double>{double(v.x), double(v.y), double(v.z)};
    };
    const auto fixed = exact(virtual_coupling_force(coupling<FixedNumbers>(), at(0), at(3)));
    const auto truth =
        virtual_coupling_force(coupling<DoubleNumbers>(), exact(at(0)), exact(at(3)));
    RC_ASSERT(dot(fixed, exact(at(0))) >= 0.0);
    if (norm(exact(at(0))) < 0.05) return;  // short springs have coarse directions
    if (norm(exact(at(0))) > 3000 || norm(exact(at(3))) > 10'000) return;
    RC_ASSERT(norm(fixed - truth) <= 2e-3 * (1 + norm(truth)));
  }));
}

}  // namespace kerf::coupling_test
