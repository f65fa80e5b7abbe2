// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <doctest/doctest.h>

#include "controller/stability/sampled_loop.hpp"

namespace kerf::stable_gains_test {
namespace {

constexpr double kMassKg = 0.045;
constexpr double kPeriodS = 0.001;
/// N/mm of alpha = K T^2/m = 1, and N s/mm of beta = B T/m = 1 (and of delta = b T/m).
constexpr double kStiffnessUnit = kMassKg / (kPeriodS * kPeriodS) / 1000;
constexpr double kDampingUnit = kMassKg / kPeriodS / 1000;

SampledLoop bare(double delay_periods = 0) {
  SampledLoop loop;
  loop.mass_kg = kMassKg;
  loop.period_s = kPeriodS;
  loop.delay_s = delay_periods * kPeriodS;
  return loop;
}

double alpha_max(const SampledLoop& loop, double beta) {
  return highest_stiffness(loop, beta * kDampingUnit) / kStiffnessUnit;
}

double alpha_exact(double beta) {
  return 2 * beta * (2 - beta) / (2 + beta);
}

SampledLoop omni(double delay_periods) {
  SampledLoop loop = bare(delay_periods);
  loop.viscous_ns_per_mm = 0.0002;  // 0.2 N s/m
  return loop;
}

}  // namespace

TEST_CASE("without delay and friction the boundary is the closed form") {  // S1
  for (const double beta : {0.05, 0.1, 0.2, 0.4, 0.8, 1.5, 1.99}) {
    CAPTURE(beta);
    CHECK(alpha_max(bare(), beta) == doctest::Approx(alpha_exact(beta)).epsilon(1e-9));
  }
}

TEST_CASE("its maximum is 12 - 8 sqrt 2 at 2 sqrt 2 - 2") {  // S2
  double best = 0, best_beta = 0;
  for (double beta = 0.8; beta < 0.86; beta += 1e-4) {
    const double alpha = alpha_max(bare(), beta);
    if (alpha > best) {
      best = alpha;
      best_beta = beta;
    }
  }
  CHECK(std::abs(best - (12 - 8 * std::sqrt(2.0))) < 1e-4);
  CHECK(std::abs(best_beta - (2 * std::sqrt(2.0) - 2)) < 2e-3);
}

TEST_CASE("a delay shrinks the region as computed elsewhere, parts of a period as well") {  // S3
  struct Row {
    double delay;
    std::array<double, 5> alpha;  // at beta .05 .1 .2 .4 .8
    double best_beta, best_alpha;
  };
  const std::vector<Row> rows{
      {0.5, {.04752, .09012, .16098, .24762, .21818}, .552, .26696},
      {1, {.03147, .05920, .10321, .14396, .02019}, .425, .14447},
      {2, {.01857, .03417, .05563, .05149, 0}, .2915, .06243},
      {3, {.01302, .02332, .03436, 0, 0}, .2225, .03478},
  };
  constexpr std::array<double, 5> kBetas{.05, .1, .2, .4, .8};
  for (const Row& row : rows) {
    CAPTURE(row.delay);
    for (std::size_t i = 0; i < kBetas.size(); ++i) {
      CAPTURE(kBetas[i]);
      CHECK(std::abs(alpha_max(bare(row.delay), kBetas[i]) - row.alpha[i]) < 1e-5);
    }
    CHECK(std::abs(alpha_max(bare(row.delay), row.best_beta) - row.best_alpha) < 1e-5);
  }
}

TEST_CASE("damping alone has a limit, which the delay lowers") {
  const std::array<std::array<double, 2>, 5> rows{
      {{0, 2}, {.5, 1.1429}, {1, .8284}, {2, .5359}, {3, .3978}}};
  for (const auto& [delay, beta] : rows) {
    CAPTURE(delay);
    CHECK(std::abs(highest_damping(bare(delay)) / kDampingUnit - beta) < 1e-4);
    CHECK(highest_stiffness(bare(delay), 1.001 * highest_damping(bare(delay))) == 0);
    CHECK(highest_stiffness(bare(delay), 0.999 * highest_damping(bare(delay))) > 0);
  }
}

TEST_CASE("without virtual damping the device's carries the wall") {  // S4
  struct Row {
    double delta;
    std::array<double, 3> ratio;  // of K to b/(T/2 + td), at d = 0, 1, 2
  };
  for (const Row& row : std::vector<Row>{{.001, {1.0002, 1.0003, 1.0004}},
                                         {.01, {1.0017, 1.0028, 1.0043}},
                                         {.1, {1.017, 1.027, 1.041}},
                                         {1, {1.196, 1.207, 1.267}}}) {
    for (std::size_t d = 0; d < 3; ++d) {
      SampledLoop loop = bare(double(d));
      loop.viscous_ns_per_mm = row.delta * kDampingUnit;
      const double rule = loop.viscous_ns_per_mm / (kPeriodS / 2 + loop.delay_s);
      CAPTURE(row.delta);
      CAPTURE(d);
      CHECK(std::abs(highest_stiffness(loop, 0) / rule - row.ratio[d]) < 1e-3);
    }
  }
  CHECK(highest_stiffness(bare(), 0) == 0);
}

TEST_CASE("a velocity filter costs stiffness") {  // S5
  struct Row {
    double samples;
    std::array<double, 4> alpha;  // at beta .05 .1 .2 .4
  };
  constexpr std::array<double, 4> kBetas{.05, .1, .2, .4};
  for (const Row& row : std::vector<Row>{{1, {.0785, .1313, .2000, .2667}},
                                         {3, {.0521, .0772, .1056, .1291}},
                                         {5, {.0380, .0538, .0712, .0849}}}) {
    SampledLoop loop = bare();
    loop.velocity_filter_s = row.samples * kPeriodS;
    for (std::size_t i = 0; i < kBetas.size(); ++i) {
      CHECK(std::abs(alpha_max(loop, kBetas[i]) - row.alpha[i]) < 5e-5);  // its last digit
    }
  }
}

TEST_CASE("the plant of an Omni has the tabled boundary, alone and held") {  // S6
  constexpr std::array<double, 7> kDampings{0, .5, 1, 2, 5, 10, 20};         // N s/m
  const std::array<std::array<double, 7>, 4> alone{{
      {400.3, 1385.6, 2349.1, 4212.2, 9314.5, 16340.6, 25756.8},
      {133.5, 461.5, 781.3, 1396.0, 3040.3, 5103.1, 6588.1},
      {80.2, 276.2, 465.9, 826.2, 1747.2, 2699.1, 1865.1},
      {57.3, 196.7, 330.6, 581.2, 1185.8, 1613.7, 0},
  }};
  for (std::size_t d = 0; d < alone.size(); ++d) {
    for (std::size_t i = 0; i < kDampings.size(); ++i) {
      CAPTURE(d);
      CAPTURE(kDampings[i]);
      const double k = 1000 * highest_stiffness(omni(double(d)), kDampings[i] / 1000);
      CHECK(std::abs(k - alone[d][i]) <= 0.002 * alone[d][i]);
    }
  }
  constexpr std::array<double, 4> kHeldDampings{0, 1, 2, 5};
  const std::array<std::array<double, 4>, 3> held{
      {{6424, 8373, 10295, 15903}, {2148, 2796, 3434, 5286}, {1294, 1680, 2058, 3146}}};
  for (std::size_t d = 0; d < held.size(); ++d) {
    SampledLoop loop = omni(double(d));
    loop.hand = {0.1, 0.003, 0.2};
    for (std::size_t i = 0; i < kHeldDampings.size(); ++i) {
      CAPTURE(d);
      CAPTURE(kHeldDampings[i]);
      const double k = 1000 * highest_stiffness(loop, kHeldDampings[i] / 1000);
      CHECK(std::abs(k / held[d][i] - 1) < 0.002);
    }
  }
}

TEST_CASE("the region scales with m/T and m/T^2, and each boundary parts stable from unstable") {
  SampledLoop loop = bare(0.3);
  loop.velocity_filter_s = 0.002;
  const double k = highest_stiffness(loop, 0.002);
  REQUIRE(k > 0);
  CHECK(is_stable(loop, 0.999 * k, 0.002));
  CHECK_FALSE(is_stable(loop, 1.001 * k, 0.002));

  SampledLoop other = loop;  // a tenth of the mass, an eighth of the period
  other.mass_kg /= 10;
  other.period_s /= 8;
  other.delay_s /= 8;
  other.velocity_filter_s /= 8;
  CHECK(highest_stiffness(other, 0.002 * 8 / 10) == doctest::Approx(k * 64 / 10).epsilon(1e-6));
}

TEST_CASE("the ends of what a scene can ask for give numbers") {
  for (const double mass : {0.005, 5.0}) {
    for (const double rate : {250.0, 8000.0}) {
      for (const double delay : {0.0, 0.49, 8.0, 64.0, 1000.0}) {
        SampledLoop loop = bare();
        loop.mass_kg = mass;
        loop.period_s = 1 / rate;
        loop.delay_s = delay * loop.period_s;
        loop.viscous_ns_per_mm = 0.005;
        const double k = highest_stiffness(loop, 0);
        CAPTURE(mass);
        CAPTURE(rate);
        CAPTURE(delay);
        CHECK(std::isfinite(k));
        // The rule of small gains; exact only far from the damping's own time constant.
        const double used = std::min(delay, kerf::kMaxDelayPeriods) * loop.period_s;
        CHECK(k > 0.99 * loop.viscous_ns_per_mm / (loop.period_s / 2 + used));
        CHECK(highest_damping(loop) > 0);
      }
    }
  }
}

}  // namespace kerf::stable_gains_test
