// SPDX-License-Identifier: Apache-2.0
// The energy at the device port: exact for a force that is held, and split by where it comes from.
#include "controller/servo/energy_ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <random>

#include <doctest/doctest.h>

namespace kerf::energy_ledger_test {
namespace {

template <class N>
DeviceVec<typename N::Real> vec(double x, double y, double z) {
  using Real = typename N::Real;
  return {Real(x), Real(y), Real(z)};
}

template <class N>
double mj(typename N::Energy energy) {
  return N::kIsFixed ? double(energy) / kEnergyStepsPerMj : double(energy);
}
template <class N>
double mj(const EnergyLedger<N>& ledger, EnergySource source) {
  return mj<N>(ledger.by_source_mj()[static_cast<std::size_t>(source)]);
}

template <class N>
DeviceVec<typename N::Real> sum(const ForceParts<N>& parts) {
  return parts.spring + parts.damping + parts.friction + parts.cutting + parts.limits +
         parts.stabiliser;
}

/// Ticks of random parts and motions, with gaps over which the force fades where `gaps`.
template <class N>
EnergyLedger<N> random_run(int ticks, bool gaps) {
  std::mt19937 random(7);
  const auto any = [&](double most) {
    return most * (2.0 * double(random()) / double(std::mt19937::max()) - 1);
  };
  const auto force = [&](double most) {
    const double x = any(most), y = any(most), z = any(most);
    return vec<N>(x, y, z);
  };
  EnergyLedger<N> ledger;
  ForceParts<N> parts;
  for (int i = 0; i < ticks; ++i) {
    const std::uint32_t gap = gaps && random() % 4 == 0 ? 2 + std::uint32_t(random() % 18) : 1;
    const auto sent = sum<N>(parts) * typename N::Real(gap == 1 ? 1.0 : 0.6);
    ledger.move(sent, force(2.0), gap);
    parts = {random() % 8 != 0, force(3), force(1), force(0.5), force(0.5), force(1), force(2)};
    ledger.split(parts);
    ledger.send(parts);
  }
  return ledger;
}

/// A wall of stiffness K below 0 against a hand at `at_mm`, sampled and held.
template <class N, class At>
EnergyLedger<N> press(double n_per_mm, int ticks, At at_mm) {
  using Real = typename N::Real;
  EnergyLedger<N> ledger;
  ForceParts<N> parts;
  Real last = static_cast<Real>(at_mm(0));
  for (int i = 0; i <= ticks; ++i) {
    const Real at = static_cast<Real>(at_mm(i));
    ledger.move(sum<N>(parts), {Real(0), at - last, Real(0)}, 1);
    last = at;
    parts = {.contact = true, .spring = vec<N>(0, n_per_mm * std::max(0.0, -double(at)), 0)};
    ledger.split(parts);
    ledger.send(parts);
  }
  return ledger;
}

}  // namespace

TEST_CASE("the sources sum up to the energy of the port: in fixed to the last bit") {
  for (const bool gaps : {false, true}) {
    CAPTURE(gaps);
    const auto fixed = random_run<FixedNumbers>(20'000, gaps);
    const auto& steps = fixed.by_source_mj();
    CHECK(fixed.total_mj() != 0);
    CHECK(std::accumulate(steps.begin(), steps.end(), std::int64_t{0}) == fixed.total_mj());
    CHECK((mj(fixed, EnergySource::hold) == 0) == !gaps);

    const auto truth = random_run<DoubleNumbers>(1'000, gaps);
    const auto& parts = truth.by_source_mj();
    const double largest =
        std::abs(*std::ranges::max_element(parts, {}, [](double part) { return std::abs(part); }));
    CHECK(std::abs(std::accumulate(parts.begin(), parts.end(), 0.0) - truth.total_mj()) <
          1e-12 * largest);
    if (!gaps) CHECK(std::abs(mj(truth, EnergySource::hold)) < 1e-12);
  }
}

TEST_CASE_TEMPLATE("a spring gives back what it stored, and the hold leaks K dx^2 / 2 a tick", N,
                   FixedNumbers, DoubleNumbers) {
  constexpr double kStiffness = 0.5, kMostMm = 1.0;
  constexpr int kTicks = 64;  // places are whole steps of the fixed format, and come back exactly
  const auto ledger = press<N>(kStiffness, 2 * kTicks, [](int i) {
    return -kMostMm * (i <= kTicks ? i : 2 * kTicks - i) / kTicks;
  });
  const double step_mm = kMostMm / kTicks;
  CHECK(mj(ledger, EnergySource::spring) == 0);
  CHECK(mj(ledger, EnergySource::leak) == -kStiffness * step_mm * step_mm / 2 * 2 * kTicks);
  CHECK(mj<N>(ledger.total_mj()) == mj(ledger, EnergySource::leak));
  CHECK(mj<N>(ledger.lowest_mj()) == mj<N>(ledger.total_mj()));

  const auto half_way = press<N>(kStiffness, kTicks, [](int i) { return -kMostMm * i / kTicks; });
  CHECK(mj(half_way, EnergySource::spring) == kStiffness * kMostMm * kMostMm / 2);
  CHECK(mj<N>(half_way.lowest_mj()) == 0);
}

TEST_CASE_TEMPLATE("the leak is a damper of -K T / 2", N, FixedNumbers, DoubleNumbers) {
  constexpr double kStiffness = 0.8, kPeriodS = 1e-3, kAmplitudeMm = 2, kRadPerS = 40;
  const auto at = [](int i) {  // always inside of the wall
    return -3 + kAmplitudeMm * std::sin(kRadPerS * kPeriodS * i);
  };
  const int ticks = static_cast<int>(std::lround(10 * 2 * std::numbers::pi / kRadPerS / kPeriodS));
  const auto ledger = press<N>(kStiffness, ticks, at);
  const double mean_square = std::pow(kAmplitudeMm * kRadPerS, 2) / 2;  // of the velocity
  const double leak_mj = -kStiffness * kPeriodS / 2 * mean_square * ticks * kPeriodS;
  CHECK(mj(ledger, EnergySource::leak) == doctest::Approx(leak_mj).epsilon(2e-3));
}

TEST_CASE_TEMPLATE(
    "a gap leaves the spring its store, leaks as its ticks would, and the rest is "
    "the hold's",
    N, FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  constexpr double kStiffness = 0.5, kFromMm = 1, kToMm = 1.5;
  constexpr std::uint32_t kGap = 10;
  const auto spring = [](double depth_mm) {
    return ForceParts<N>{.contact = true, .spring = vec<N>(0, kStiffness * depth_mm, 0)};
  };
  for (const double share : {1.0, 0.7}) {  // held all the time; faded, to this mean
    CAPTURE(share);
    EnergyLedger<N> ledger;
    ledger.send(spring(kFromMm));
    const double sent_n = share * kStiffness * kFromMm;
    ledger.move(vec<N>(0, sent_n, 0), {Real(0), Real(kFromMm - kToMm), Real(0)}, kGap);
    ledger.split(spring(kToMm));
    const double moved_mm = kToMm - kFromMm;
    const double stored_mj = kStiffness * (kToMm * kToMm - kFromMm * kFromMm) / 2;
    const double leak_mj = -kStiffness * moved_mm * moved_mm / 2 / kGap;
    CHECK(mj<N>(ledger.total_mj()) == doctest::Approx(sent_n * moved_mm).epsilon(1e-4));
    CHECK(mj(ledger, EnergySource::spring) == doctest::Approx(stored_mj).epsilon(1e-6));
    CHECK(mj(ledger, EnergySource::leak) == doctest::Approx(leak_mj).epsilon(1e-6));
    CHECK(mj(ledger, EnergySource::hold) ==
          doctest::Approx(sent_n * moved_mm - stored_mj - leak_mj).epsilon(1e-4));
  }
}

TEST_CASE("S14: the observer is the integral of force and velocity, whatever the hand does") {
  // A mass on a damper and a sampled wall of 4 N/mm, integrated in 2000 steps a tick.
  constexpr double kMassKg = 0.045, kDampingNsPerM = 0.2, kPeriodS = 1e-3, kPushN = 1;
  constexpr double kStiffnessNPerM = 4000;
  constexpr int kSteps = 2000;
  EnergyLedger<DoubleNumbers> ledger;
  ForceParts<DoubleNumbers> parts;
  double x_m = 1e-4, v_m_per_s = 0, integral_j = 0, last_mm = x_m * 1000, lowest_j = 0;
  for (int tick = 0; tick < 300; ++tick) {
    const double at_mm = x_m * 1000;
    ledger.move(parts.spring, {0, at_mm - last_mm, 0}, 1);
    last_mm = at_mm;
    CHECK(std::abs(ledger.total_mj() / 1000 - integral_j) < 1e-9);
    lowest_j = std::min(lowest_j, integral_j);
    const double force_n = kStiffnessNPerM * std::max(0.0, -x_m);
    parts = {.contact = true, .spring = {0, force_n, 0}};
    ledger.split(parts);
    ledger.send(parts);
    for (int i = 0; i < kSteps; ++i) {
      constexpr double kStepS = kPeriodS / kSteps;
      const double before_m_per_s = v_m_per_s;
      v_m_per_s += (force_n - kPushN - kDampingNsPerM * v_m_per_s) / kMassKg * kStepS;
      const double mean_m_per_s = (before_m_per_s + v_m_per_s) / 2;
      x_m += mean_m_per_s * kStepS;
      integral_j -= force_n * mean_m_per_s * kStepS;
    }
  }
  REQUIRE(lowest_j < -1e-4);  // this wall is active
  CHECK(std::abs(ledger.lowest_mj() / 1000 - lowest_j) < 1e-9);
}

TEST_CASE("energies stay at the ends of their range") {
  EnergyLedger<FixedNumbers> ledger;
  const auto far = vec<FixedNumbers>(32767, 32767, 32767);
  for (const double sign : {1.0, -1.0}) {
    const ForceParts<FixedNumbers> parts{true, far * Q16(sign), far, far, far * Q16(-sign), far,
                                         far};
    for (int i = 0; i < 8; ++i) {
      ledger.move(far * Q16(sign), far, i % 2 == 0 ? 1 : 1000);
      ledger.split(parts);
      ledger.send(parts);
    }
  }
  CHECK(ledger.lowest_mj() == INT64_MIN);
  CHECK(ledger.total_mj() > 0);
}

}  // namespace kerf::energy_ledger_test
