// SPDX-License-Identifier: Apache-2.0
// The time-domain loop against the exact boundary and against maps that another simulator made
// (100 sub-steps of semi-implicit Euler, Karnopp's stiction, 0.1 mm before the wall, K in steps of
// 3 %).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <doctest/doctest.h>

#include "controller/stability/axis_simulation.hpp"
#include "controller/stability/limit_cycle.hpp"
#include "controller/stability/sampled_loop.hpp"

namespace kerf::one_axis_test {
namespace {

constexpr double kSi = 1e-3;  // N/m to N/mm, N s/m to N s/mm

SampledLoop omni(double viscous_ns_per_m, double coulomb_n, double quantum_mm,
                 double delay_ms = 0) {
  SampledLoop loop;
  loop.mass_kg = 0.045;
  loop.viscous_ns_per_mm = viscous_ns_per_m * kSi;
  loop.coulomb_n = coulomb_n;
  loop.quantum_mm = quantum_mm;
  loop.delay_s = delay_ms * 1e-3;
  return loop;
}

/// The lowest K that swings by more than three encoder steps, as the tables have it: by a scan of
/// 35 % around `about` in steps of 2 %. With friction and an encoder rest becomes swing not at one
/// K but in a band, in which single walls rest above others that swing.
double first_swing(const SampledLoop& loop, double damping_ns_per_mm, double push_n,
                   double about_n_per_mm) {
  constexpr double kBand = 1.35, kStep = 1.02;
  for (double k = about_n_per_mm / kBand; k < about_n_per_mm * kBand; k *= kStep) {
    const LimitCycle run = push_on_wall(loop, k, damping_ns_per_mm, {.push_n = push_n});
    if (run.swings && run.travel_mm > 3 * loop.quantum_mm) return k;
  }
  return about_n_per_mm * kBand;
}

/// Whether a small swing about the depth at which the hand's push and the wall rest grows: contact
/// is not lost before it has grown, so the loop stays linear. One that has grown as far as it can,
/// with the contact lost in each turn, keeps its width.
bool grows(const SampledLoop& loop, double stiffness_n_per_mm, double damping_ns_per_mm) {
  constexpr double kPushN = 1;
  AxisSimulation axis(loop);
  axis.start(kPushN / stiffness_n_per_mm * (1 + 1e-6));
  SampledWall wall(loop, stiffness_n_per_mm, damping_ns_per_mm);
  wall.start(axis.encoder_mm());
  std::array<double, 3> span_mm{};  // peak to peak, in each third of 1.5 s
  for (double& span : span_mm) {
    double low = axis.place_mm(), high = low;
    for (int tick = 0; tick < 0.5 / loop.period_s; ++tick) {
      axis.tick(wall.force_n(axis.encoder_mm()), kPushN);
      low = std::min(low, axis.place_mm());
      high = std::max(high, axis.place_mm());
    }
    span = high - low;
  }
  return span_mm[2] >= 0.99 * span_mm[1];
}

}  // namespace

TEST_CASE("S9: in time the loop without friction has the exact boundary within 2 %") {
  for (const double delay_ms : {0.0, 0.5, 1.0, 2.0, 3.0}) {
    for (const double damping : {0.0, 0.5, 2.0, 5.0, 10.0}) {
      CAPTURE(delay_ms);
      CAPTURE(damping);
      const SampledLoop loop = omni(0.2, 0, 0, delay_ms);
      const double exact = highest_stiffness(loop, damping * kSi);
      REQUIRE(exact > 0);
      CHECK_FALSE(grows(loop, exact * 0.98, damping * kSi));
      CHECK(grows(loop, exact * 1.02, damping * kSi));
    }
  }
  // Filtered velocity, another rate, a hand.
  SampledLoop held = omni(0.2, 0, 0, 2);
  held.velocity_filter_s = 0.003;
  held.period_s = 0.00025;
  held.hand = {0.1, 0.003, 0.2};
  const double exact = highest_stiffness(held, 0.002);
  CHECK_FALSE(grows(held, exact * 0.98, 0.002));
  CHECK(grows(held, exact * 1.02, 0.002));
}

TEST_CASE("S10: Coulomb friction alone makes a stable region, by the tabled 12 cells") {
  constexpr std::array<double, 4> kCoulombN{0.02, 0.05, 0.10, 0.26};
  constexpr std::array<double, 3> kQuantumMm{0.02, 0.055, 0.2};
  constexpr double kHighest[4][3] = {
      {384, 384, 373}, {1736, 1588, 1497}, {4603, 4213, 3743}, {15930, 15016, 10532}};
  for (std::size_t i = 0; i < kCoulombN.size(); ++i) {
    for (std::size_t j = 0; j < kQuantumMm.size(); ++j) {
      CAPTURE(kCoulombN[i]);
      CAPTURE(kQuantumMm[j]);
      const SampledLoop loop = omni(0, kCoulombN[i], kQuantumMm[j]);
      CHECK(highest_stiffness(loop, 0) == 0);  // the linear loop has none
      const double tabled = kHighest[i][j] * kSi;
      CHECK(std::abs(first_swing(loop, 0, 0.5, tabled) / tabled - 1) < 0.1);
    }
  }
}

TEST_CASE("S11: with delay, damping and friction the boundaries are the tabled ones") {
  struct Row {
    double coulomb_n, delay_ms;
    std::vector<double> highest;
  };
  constexpr std::array<double, 5> kDamping{0, 1, 2, 5, 10};
  constexpr std::array<double, 4> kFew{0, 1, 2, 5};
  const std::vector<Row> rows{{0.26, 0, {8563, 10532, 12953, 19022, 25564}},
                              {0.26, 1, {1453, 2402, 3043, 5030, 7387}},
                              {0.26, 2, {635, 1182, 1636, 2625, 3855}},
                              {0.26, 3, {362, 736, 1050, 1736, 2332}},
                              {0.05, 0, {1254, 3528, 5661, 10532}},
                              {0.05, 1, {270, 1019, 1685, 3325}},
                              {0.05, 2, {141, 564, 961, 1841}}};
  for (const Row& row : rows) {
    const SampledLoop loop = omni(0.2, row.coulomb_n, 0.055, row.delay_ms);
    for (std::size_t i = 0; i < row.highest.size(); ++i) {
      const double damping = (row.highest.size() == kFew.size() ? kFew[i] : kDamping[i]) * kSi;
      CAPTURE(row.coulomb_n);
      CAPTURE(row.delay_ms);
      CAPTURE(damping);
      const double tabled = row.highest[i] * kSi;
      CHECK(std::abs(first_swing(loop, damping, 1, tabled) / tabled - 1) < 0.1);
    }
  }
}

TEST_CASE("S12: more damping of the device makes the region larger, a higher rate allows more K") {
  for (const Personality device :
       {Personality::omni, Personality::falcon, Personality::woodenhaptics}) {
    double at_rate = 0;
    for (const double rate_hz : {250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0}) {
      SampledLoop loop = unheld_loop(device, rate_hz);
      const double highest = highest_stiffness(loop, 0.002);
      CHECK(highest > at_rate);
      at_rate = highest;
      for (const double damping : {0.0, 0.002, 0.01}) {
        double at_viscous = 0;
        for (const double viscous : {0.0002, 0.0005, 0.002, 0.01}) {
          CAPTURE(rate_hz);
          CAPTURE(damping);
          CAPTURE(viscous);
          loop.viscous_ns_per_mm = viscous;
          const double more = highest_stiffness(loop, damping);
          CHECK(more > at_viscous);
          at_viscous = more;
        }
      }
    }
  }
}

TEST_CASE("S13: each sample of delay costs stiffness, with friction and without") {
  // With friction, between what two delays bear: quiet at the shorter one, loud at the longer.
  constexpr std::array<double, 4> kByTable{8.563, 1.453, 0.635, 0.362};
  for (const double damping : {0.0, 1.0, 2.0, 5.0, 10.0}) {
    double before = 1e9;
    for (const double delay_ms : {0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0}) {
      CAPTURE(damping);
      CAPTURE(delay_ms);
      const double highest = highest_stiffness(omni(0.2, 0, 0, delay_ms), damping * kSi);
      CHECK(highest < before);
      before = highest;
    }
  }
  for (std::size_t d = 1; d < kByTable.size(); ++d) {
    CAPTURE(d);
    const double between = std::sqrt(kByTable[d - 1] * kByTable[d]);
    const auto swings = [&](double delay_ms) {
      return !push_on_wall(omni(0.2, 0.26, 0.055, delay_ms), between, 0, {.push_n = 1}).rests();
    };
    CHECK_FALSE(swings(static_cast<double>(d) - 1));
    CHECK(swings(static_cast<double>(d)));
  }
}

TEST_CASE("S17: one difference knows velocity in quanta of D/T alone") {
  SampledLoop loop = omni(0.2, 0.05, 0.055);
  AxisSimulation axis(loop);
  axis.start(0.0123);
  double last_mm = axis.encoder_mm();
  int moved = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    axis.tick(0, tick < 1000 ? 0.3 : -0.5);
    const double mm_per_s = (axis.encoder_mm() - last_mm) / loop.period_s;
    last_mm = axis.encoder_mm();
    const double levels = mm_per_s / 55;
    CHECK(std::abs(levels - std::round(levels)) < 1e-6);
    moved += std::abs(levels) > 0.5 ? 1 : 0;
  }
  CHECK(moved > 1000);
}

TEST_CASE("a wall that swings gives the energy that friction takes, a quiet one takes it") {
  const SampledLoop loop = omni(0.2, 0.05, 0.055, 2);
  const LimitCycle quiet = push_on_wall(loop, 0.4, 0.002);
  CHECK(quiet.rests());
  CHECK(quiet.given_mj == 0);
  const LimitCycle loud = push_on_wall(loop, 2, 0.002);
  CHECK(loud.swings);
  CHECK(loud.active);
}

TEST_CASE("a limit cycle that fluctuates is never at rest, whether its travel falls or grows") {
  // In 3 s the travel of the last second is 0.92, 0.82, 0.56, 0.85 and 0.94 of the one before; in
  // 60 s it is larger still.
  struct Row {
    double coulomb_n, damping_ns_per_mm, stiffness_n_per_mm;
  };
  for (const Row& row : std::vector<Row>{{0.05, 0.001, 4.7},
                                         {0.05, 0.002, 6.81},
                                         {0.05, 0.005, 12.62},
                                         {0.1, 0.001, 8.42},
                                         {0.1, 0.002, 9.66}}) {
    CAPTURE(row.stiffness_n_per_mm);
    const SampledLoop loop = omni(0.2, row.coulomb_n, 0.055);
    for (const double seconds : {3.0, 6.0, 12.0, 60.0}) {
      CAPTURE(seconds);
      const LimitCycle run =
          push_on_wall(loop, row.stiffness_n_per_mm, row.damping_ns_per_mm, {.seconds = seconds});
      CHECK_FALSE(run.rests());
      CHECK(run.swings);
      CHECK(run.travel_mm > 1);
    }
  }
}

TEST_CASE("a hum within one encoder step that the motors feed is not at rest, nor a slow decay") {
  const LimitCycle hum = push_on_wall(omni(0.2, 0.05, 0.055), 0.8 * 5.661, 0.002, {.push_n = 1});
  CHECK_FALSE(hum.swings);
  CHECK(hum.travel_mm < 0.055);
  CHECK(hum.active);
  CHECK_FALSE(hum.rests());
  const SampledLoop smooth = omni(0.2, 0, 0);
  CHECK_FALSE(push_on_wall(smooth, 0.01, 0, {.seconds = 3}).rests());
  CHECK(push_on_wall(smooth, 0.4, 0.002).rests());
}

TEST_CASE("without a force the axis coasts as its equation says, whatever the delay") {
  SampledLoop loop = omni(2, 0, 0, 1.3);
  loop.hand = {0.1, 0.001, 0.2};
  AxisSimulation axis(loop);
  axis.start(1);
  for (int tick = 0; tick < 100; ++tick) axis.tick(0, 0);
  // m x'' + b x' + k x = 0 from x = 1 at rest, after 0.1 s.
  const double m = 0.145, b = 3, k = 200, t = 0.1;
  const double decay = b / (2 * m), w = std::sqrt(k / m - decay * decay);
  CHECK(axis.place_mm() ==
        doctest::Approx(std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t)))
            .epsilon(1e-9));
}

}  // namespace kerf::one_axis_test
