// SPDX-License-Identifier: Apache-2.0
// The detector's memory ends where it should: what a run did before its last half decides nothing,
// and a rest that a motion interrupts is none.
#include "controller/stability/limit_cycle.hpp"

#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>

namespace kerf::limit_cycle_test {
namespace {

constexpr std::int64_t kLimit = 16'000, kSettled = 200;

/// The verdict on a tip and an energy as functions of the tick; held where neither changes.
template <class Tip, class Energy>
LimitCycle verdict_on(double step_mm, const Tip& tip_mm, const Energy& given_mj,
                      std::int64_t* ticks = nullptr) {
  LimitCycleDetector detector({.limit = kLimit, .first = 500, .settled = kSettled}, step_mm, 1.0);
  for (std::int64_t tick = 0; tick <= kLimit; ++tick) {
    const bool held = tick > 0 && tip_mm(tick) == tip_mm(tick - 1);
    if (!detector.take(tip_mm(tick), given_mj(tick), held)) continue;
    if (ticks != nullptr) *ticks = tick + 1;
    return detector.verdict();
  }
  FAIL("no verdict at the limit");
  return {};
}

double no_energy(std::int64_t) {
  return 0;
}
/// A square swing of 1 mm that stays at each end for `half` ticks, over 2 ticks from end to end.
double square(std::int64_t tick, std::int64_t half) {
  const std::int64_t at = tick % (2 * half);
  if (at == 0 || at == half) return 0.5;
  return at < half ? 0 : 1;
}

}  // namespace

TEST_CASE("a swing that rests at each end for a while is a swing, however long it goes on") {
  for (const std::int64_t half : {20, 100, 150, 199}) {
    CAPTURE(half);
    std::int64_t ticks = 0;
    const LimitCycle run = verdict_on(
        0.05, [&](std::int64_t tick) { return square(tick, half); }, no_energy, &ticks);
    CHECK(run.swings);
    CHECK_FALSE(run.rests());
    CHECK(run.travel_mm == 1);
    CHECK(ticks == kLimit);
  }
  // Held for longer than the loop remembers: a fixed point, at once.
  std::int64_t ticks = 0;
  CHECK(verdict_on(
            0.05, [](std::int64_t tick) { return tick < 900 ? square(tick, 50) : 0.25; }, no_energy,
            &ticks)
            .rests());
  CHECK(ticks == 900 + kSettled + 2);
}

TEST_CASE("what a run did in its first half does not count") {
  const auto trembles = [](std::int64_t tick) { return 0.001 * static_cast<double>(tick % 2); };
  for (const double step_mm : {0.05, 0.0}) {
    CAPTURE(step_mm);
    const double still = step_mm > 0 ? 1 : 0.01;  // below the step, or the limit without one
    const LimitCycle run = verdict_on(
        step_mm,
        [&](std::int64_t tick) {
          return tick < kLimit / 2 - 10 ? square(tick, 30) + trembles(tick)
                                        : still * trembles(tick);
        },
        [](std::int64_t tick) { return tick < kLimit / 2 - 10 ? 0.01 * double(tick) : 80.0; });
    CHECK(run.rests());
    CHECK(run.travel_mm <= 0.001);
    CHECK(run.given_mj == 0);
    CHECK(run.port_minimum_mj == -80);
  }
}

TEST_CASE("a swing that begins late is one, and energy that begins late is active") {
  const auto late = [](std::int64_t tick) {
    return tick < kLimit / 2 - 100 ? 0.001 * static_cast<double>(tick % 2) : square(tick, 40);
  };
  const LimitCycle run = verdict_on(0.05, late, [](std::int64_t tick) {
    return tick < kLimit / 2 - 100 ? 0.0 : 0.02 * double(tick - kLimit / 2 + 100);
  });
  CHECK(run.swings);
  CHECK(run.active);
  // Each swing turns at both ends: so few that each end is needed.
  CHECK(verdict_on(
            0.05, [](std::int64_t tick) { return 0.5 + 0.5 * std::sin(double(tick) * 0.002); },
            no_energy)
            .swings);
  // A drift never turns, nor does a step there and no more.
  CHECK_FALSE(verdict_on(
                  0.05, [](std::int64_t tick) { return 1e-4 * double(tick); }, no_energy)
                  .swings);
}

TEST_CASE("a second run by a new detector has the verdict of the first") {
  const auto swing = [](std::int64_t tick) { return square(tick, 33); };
  const auto feeds = [](std::int64_t tick) { return 0.05 * double(tick); };
  const LimitCycle first = verdict_on(0.05, swing, feeds), again = verdict_on(0.05, swing, feeds);
  CHECK(first.swings == again.swings);
  CHECK(first.given_mj == again.given_mj);
  CHECK(first.given_mj == doctest::Approx(0.05 * kLimit / 2).epsilon(0.01));
}

TEST_CASE("a drift after a swing turns no more") {
  for (const double mm_per_tick : {9e-5, -9e-5}) {  // within what the swing reached
    CAPTURE(mm_per_tick);
    const LimitCycle run = verdict_on(
        0.05,
        [&](std::int64_t tick) {
          const std::int64_t drifted = tick - kLimit / 2 + 100;
          return drifted < 0 ? square(tick, 30) : 0.5 + mm_per_tick * double(drifted - kLimit / 4);
        },
        no_energy);
    CHECK_FALSE(run.swings);
    CHECK(run.undecided);
  }
}

TEST_CASE("where the tip begins does not count: its first motion is no turn") {
  constexpr double kHalf = kLimit / 2;
  for (const double side : {-1.0, 1.0}) {
    CAPTURE(side);
    LimitCycleDetector detector({.limit = kLimit, .first = kLimit, .settled = kSettled}, 0.05, 1);
    for (std::int64_t tick = 0;; ++tick) {
      const double t = double(tick);  // a turn in the first half, two are a swing
      const double tip_mm =
          t < kHalf ? side * (4 + std::abs(1 - 2 * t / kHalf)) : side * 5 + square(tick, 30);
      if (detector.take(tip_mm, 0, false)) break;
    }
    CHECK_FALSE(detector.verdict().swings);
    CHECK(detector.verdict().undecided);
  }
}

TEST_CASE("where the energy begins does not count, in a run of any length, and at rest") {
  for (const double offset_mj : {-100.0, 0.0, 100.0}) {
    CAPTURE(offset_mj);
    for (const std::int64_t first : {std::int64_t{500}, kLimit}) {
      LimitCycleDetector detector({.limit = kLimit, .first = first, .settled = kSettled}, 0.05, 1);
      for (std::int64_t tick = 0;; ++tick) {
        if (detector.take(square(tick, 40), offset_mj + 0.01 * double(tick), false)) break;
      }
      const double whole_mj = 0.01 * double(kLimit - 1);
      CHECK(detector.verdict().port_minimum_mj == doctest::Approx(-whole_mj));
      CHECK(detector.verdict().given_mj ==
            doctest::Approx(first == kLimit ? whole_mj : whole_mj / 2).epsilon(0.01));
    }
    const LimitCycle rest = verdict_on(
        0.05, [](std::int64_t) { return 2.0; },
        [&](std::int64_t tick) { return offset_mj + (tick > 0 ? 3 : 0); });
    CHECK(rest.rests());
    CHECK(rest.port_minimum_mj == -3);
  }
}

}  // namespace kerf::limit_cycle_test
