// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/law/registry/law_registry.hpp"
#include "controller/law/velocity_estimators.hpp"

namespace kerf::velocity_window_test {
namespace {

constexpr double kStepMm = 0.055;  // of the Omni's encoders at the tip
constexpr double kNoiseMm = kStepMm / 2;

/// The velocity after the tip of the next tick.
template <class N>
DeviceVec<typename N::Real> advance(VelocityWindow<N>& window, const VelocityPlan<N>& plan,
                                    std::type_identity_t<DeviceVec<typename N::Real>> tip_mm,
                                    std::uint32_t gap = 1) {
  window.take(tip_mm, gap);
  return window.velocity(plan);
}

struct Errors {
  double rms = 0, largest = 0;
};

/// Estimates along x at `rate_hz`, the place rounded to whole encoder steps.
template <class N>
Errors errors(int rate_hz, double velocity_mm_per_s) {
  using Real = typename N::Real;
  const VelocityPlan<N> plan{rate_hz, std::max(1, rate_hz / 1000), Real(kNoiseMm)};
  VelocityWindow<N> window;
  window.start({});
  double squares = 0, largest = 0;
  const int settled = rate_hz / 10;
  const int ticks = 4 * rate_hz;
  for (int k = 0; k < ticks; ++k) {
    const double x_mm = velocity_mm_per_s * k / rate_hz + 0.0123;
    const double read_mm = kStepMm * std::floor(x_mm / kStepMm + 0.5);
    const double error =
        double(advance(window, plan, {Real(read_mm), Real(), Real()}).x) - velocity_mm_per_s;
    if (k < settled) continue;
    squares += error * error;
    largest = std::max(largest, std::abs(error));
  }
  return {std::sqrt(squares / (ticks - settled)), largest};
}

}  // namespace

// A map may have 32 kHz, the servo 8.
TEST_CASE_TEMPLATE("above 8 kHz the window reads the 128 ticks that it keeps, and no others", N,
                   FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  for (const double rate_hz : {8000.0, 16000.0, 32000.0}) {
    const auto plan = plan_law<VelocityInput, N>(
        {LawKind::velocity, "foaw", {}},
        LawLoop{.rate_hz = rate_hz, .tip_noise_mm = 2});  // all samples count
    LawMemory memory;
    DeviceVec<Real> velocity{};
    const auto moved_to = [&](double x_mm) {
      velocity = plan(memory, {{Real(x_mm), Real(), Real()}, 1, !memory.begun});
    };
    for (int k = 0; k <= 400; ++k) moved_to(100 * k / rate_hz);
    CHECK(double(velocity.x) == doctest::Approx(100).epsilon(0.01));
    for (int k = 0; k <= 128; ++k) moved_to(100 * 400 / rate_hz);
    CHECK(double(velocity.x) == 0);
  }
}

TEST_CASE_TEMPLATE("S18: encoder steps of 0.055 mm at 1 kHz leave less than 0.6 mm/s", N,
                   FixedNumbers, DoubleNumbers) {
  CHECK(errors<N>(1000, 10).rms <= 0.6);
  CHECK(errors<N>(1000, 200).rms <= 0.4);
  CHECK(errors<N>(1000, 0.5).rms <= 1.5);
  // One difference alone would be off by its quantum of 55 mm/s.
  CHECK(errors<N>(8000, 10).rms <= 0.6);
  CHECK(errors<N>(8000, 200).rms <= 0.4);
}

TEST_CASE_TEMPLATE("a steady hand is seen through all 16 intervals at any speed", N, FixedNumbers,
                   DoubleNumbers) {
  // Samples off by the noise, each to the side that its weight in the slope makes the worst.
  constexpr double kWorst = 1000 * kNoiseMm * 6 * 144 / (16 * 17 * 18);
  for (const double mm_per_s : {0.7, 3.1, 10.0, 13.3, 29.0, 61.7, 200.0}) {
    CAPTURE(mm_per_s);
    CHECK(errors<N>(1000, mm_per_s).largest <= kWorst);
  }
}

TEST_CASE_TEMPLATE("a hand that stops dead is at rest within two encoder steps", N, FixedNumbers,
                   DoubleNumbers) {
  using Real = typename N::Real;
  const VelocityPlan<N> plan{1000, 1, Real(kNoiseMm)};
  VelocityWindow<N> window;
  window.start({});
  double x_mm = 0;
  for (int k = 0; k < 50; ++k) {  // 200 mm/s
    x_mm += 0.2;
    static_cast<void>(advance(window, plan, {Real(x_mm), Real(), Real()}));
  }
  double last = 0;
  for (int k = 0; k < 3; ++k) last = double(advance(window, plan, {Real(x_mm), Real(), Real()}).x);
  CHECK(std::abs(last) <= 1000 * kStepMm);
  for (int k = 0; k < 16; ++k) last = double(advance(window, plan, {Real(x_mm), Real(), Real()}).x);
  CHECK(last == 0);
}

TEST_CASE("whatever the places, the velocity is theirs within the range, and fixed is double") {
  CHECK(rc::check([](std::vector<std::int32_t> places) {
    const VelocityPlan<FixedNumbers> fixed_plan{8000, 8, Q16(kNoiseMm)};
    const VelocityPlan<DoubleNumbers> plan{8000, 8, double(Q16(kNoiseMm))};
    VelocityWindow<FixedNumbers> fixed;
    VelocityWindow<DoubleNumbers> exact;
    for (const std::int32_t raw : places) {
      const auto place = Q16::from_raw(raw);
      const double is = double(advance(fixed, fixed_plan, {place, place, place}).y);
      const double should = advance(exact, plan, {double(place), double(place), double(place)}).y;
      const double lowest = double(Q16::from_raw(INT32_MIN));
      const double highest = double(Q16::from_raw(INT32_MAX));
      RC_ASSERT(std::abs(is - std::clamp(should, lowest, highest)) <= 1e-4);
    }
  }));
}

TEST_CASE_TEMPLATE("missing reports leave a steady hand its velocity", N, FixedNumbers,
                   DoubleNumbers) {
  using Real = typename N::Real;
  for (const int rate_hz : {250, 1000, 8000}) {
    for (const std::uint32_t gap : {2U, 5U, 20U, 400U}) {  // the last is longer than the window
      CAPTURE(rate_hz);
      CAPTURE(gap);
      const VelocityPlan<N> plan{rate_hz, std::max(1, rate_hz / 1000), Real(kNoiseMm)};
      VelocityWindow<N> window;
      window.start({});
      constexpr double kMmPerS = 50;
      double x_mm = 0;
      for (int k = 0; k < rate_hz; ++k) {
        x_mm += kMmPerS / rate_hz;
        static_cast<void>(advance(window, plan, {Real(x_mm), Real(), Real()}));
      }
      for (int times = 0; times < 3; ++times) {
        x_mm += kMmPerS * gap / rate_hz;
        const double seen = double(advance(window, plan, {Real(x_mm), Real(), Real()}, gap).x);
        CHECK(seen == doctest::Approx(kMmPerS).epsilon(0.02));
      }
    }
  }
}

}  // namespace kerf::velocity_window_test
