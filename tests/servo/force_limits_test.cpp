// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/force_limits.hpp"

#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>
#include <rapidcheck.h>

namespace kerf::force_limits_test {
namespace {

template <class N>
ForceLimits<N> omni_limits() {
  using Real = typename N::Real;
  return {Real(3.3), Real(0.88), Real(0.5), typename N::Ratio(1.0 / 10000)};
}

template <class V>
double length(V v) {
  return std::sqrt(double(v.x) * double(v.x) + double(v.y) * double(v.y) +
                   double(v.z) * double(v.z));
}

}  // namespace

TEST_CASE_TEMPLATE("a force that is cut down keeps its direction, by peak, slew and heat", N,
                   FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  const DeviceVec<Real> wanted{Real(6.0), Real(-3.0), Real(2.0)};  // 7 N
  ThermalState<N> thermal;
  DeviceVec<Real> sent{};
  for (int tick = 0; tick < 20'000; ++tick) {
    sent = limited_force<N>(omni_limits<N>(), thermal, wanted, sent, false);
    const double along = (6 * double(sent.x) - 3 * double(sent.y) + 2 * double(sent.z)) / 7;
    CHECK(along == doctest::Approx(length(sent)).epsilon(1e-4));
  }
  CHECK(length(sent) < 1.0);
}

TEST_CASE("whatever is wanted, peak and slew hold, also from the ends of the number range") {
  CHECK(rc::check([](std::int32_t x, std::int32_t y, std::int32_t z) {
    ThermalState<FixedNumbers> thermal;
    DeviceVec<Q16> sent{};
    for (int tick = 0; tick < 50; ++tick) {
      const auto next = limited_force<FixedNumbers>(
          omni_limits<FixedNumbers>(), thermal,
          {Q16::from_raw(x), Q16::from_raw(y), Q16::from_raw(z)}, sent, false);
      RC_ASSERT(length(next) <= double(Q16(3.3)));
      RC_ASSERT(length(next - sent) <= 0.5 + 4e-5);  // two steps of rounding
      sent = next;
    }
  }));
}

TEST_CASE_TEMPLATE("in no tick the force changes by more than the slew, or than there was of it", N,
                   FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  const auto limits = omni_limits<N>();
  CHECK(rc::check([&] {
    const auto part = [](double most_n) {
      return Real(*rc::gen::inRange(-10'000, 10'001) * most_n / 10'000);
    };
    const DeviceVec<Real> last =
        clamped(DeviceVec<Real>{part(3.3), part(3.3), part(3.3)}, limits.peak_n);
    const double wide_n = *rc::gen::element(0.1, 1.0, 10.0);
    ThermalState<N> thermal;
    const auto sent = limited_force<N>(limits, thermal, {part(wide_n), part(wide_n), part(wide_n)},
                                       last, *rc::gen::arbitrary<bool>());
    RC_ASSERT(length(sent - last) <= std::max(0.5, length(last)) + 6e-5);
  }));
  // A force that turns round while the hand leaves with it: gone, and no farther.
  ThermalState<N> thermal;
  const auto sent = limited_force<N>(limits, thermal, {Real(-2.0), Real(0.5), Real(0.0)},
                                     {Real(1.3), Real(0.0), Real(0.0)}, true);
  CHECK(length(sent - DeviceVec<Real>{Real(1.3), Real(0.0), Real(0.0)}) <= 1.3 + 6e-5);
}

TEST_CASE_TEMPLATE("a peak held for long settles at the continuous force", N, FixedNumbers,
                   DoubleNumbers) {
  using Real = typename N::Real;
  ThermalState<N> thermal;
  DeviceVec<Real> sent{};
  const auto after = [&](double wanted_n, int ticks) {
    double peak_n = 0;
    for (int tick = 0; tick < ticks; ++tick) {
      sent = limited_force<N>(omni_limits<N>(), thermal, {Real(0.0), Real(wanted_n), Real(0.0)},
                              sent, false);
      peak_n = std::max(peak_n, length(sent));
    }
    return peak_n;
  };
  CHECK(after(3.3, 60'000) == doctest::Approx(3.3).epsilon(1e-3));
  CHECK(length(sent) == doctest::Approx(0.88).epsilon(0.02));
  after(0, 30'000);
  CHECK(after(3.3, 20) == doctest::Approx(3.3).epsilon(1e-3));  // one more after a rest
}

TEST_CASE_TEMPLATE(
    "a force falls at once while the hand leaves with it, and never grows or turns faster", N,
    FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  auto limits = omni_limits<N>();
  limits.slew_n_per_tick = Real(0.01);
  const DeviceVec<Real> last{Real(1.0), Real(2.0), Real(-2.0)};  // 3 N
  const auto sent = [&](DeviceVec<Real> wanted, bool leaves) {
    ThermalState<N> thermal;
    return limited_force<N>(limits, thermal, wanted, last, leaves);
  };
  CHECK(length(sent({}, true)) < 1e-4);
  CHECK(length(sent({}, false)) == doctest::Approx(2.99).epsilon(1e-4));
  const DeviceVec<Real> third{Real(1.0 / 3), Real(2.0 / 3), Real(-2.0 / 3)};
  CHECK(length(sent(third, true) - third) < 1e-4);
  const DeviceVec<Real> more{Real(1.1), Real(2.2), Real(-2.2)};
  CHECK(length(sent(more, true) - last) == doctest::Approx(0.01).epsilon(1e-2));
  // Against the last force: it falls to 0, and turns from there by the slew limit.
  const DeviceVec<Real> opposite{Real(-1.0), Real(-2.0), Real(2.0)};
  CHECK(length(sent(opposite, true)) == doctest::Approx(0.01).epsilon(1e-2));
  // Across it: what is left along it is nothing.
  const DeviceVec<Real> across{Real(0.0), Real(2.0), Real(2.0)};
  CHECK(length(sent(across, true)) == doctest::Approx(0.01).epsilon(1e-2));
}

}  // namespace kerf::force_limits_test
