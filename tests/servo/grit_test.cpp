// SPDX-License-Identifier: Apache-2.0
// The presets of burs against what was measured on benches: docs/cutting.md has the table.
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include <doctest/doctest.h>

#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/segment/pulp_heat.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::grit_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

constexpr double kNewtonsPerGram = 9.80665e-3;

/// A block of machinable glass ceramic under a ball.
LoadedScene bench(Grit grit, double krpm, double radius_mm = 1) {
  LoadedScene scene = half_space_scene(8);
  scene.volumes[0] = volume_of(64, kVoxelMm, [](double, double y_mm, double) { return y_mm / 2; });
  scene.cut.model = CutModel::preston;
  scene.cut.threshold_n = 0.05;
  scene.cut.machinability_mm3_per_s_n =
      kEnamelMm3PerSN * known_material("glass_ceramic").machinability;
  scene.limits.continuous_force_n = scene.limits.force_n;  // a bench needs no rest
  scene.spindle.speed_krpm = krpm;
  scene.spindle.stall_torque_n_mm = 30;  // that of an electric handpiece: it holds its speed
  scene.spindle.inertia_g_mm2 = 45;
  scene.tools[0] = make_tool("bur", "ball", {.pitch_mm = kVoxelMm, .radius_mm = radius_mm});
  scene.tools[0].law = grit_law(grit);
  return scene;
}

struct Rate {
  double mm3_per_s = 0, press_n = 0;
};

/// Removal by a load, while the hand leads the bur to and fro and down as it cuts.
Rate under(double grams, Grit grit, double krpm) {
  const LoadedScene scene = bench(grit, krpm);
  CuttingHand miller(scene, {-1, 1.3, 0});
  constexpr int kSettleMs = 100, kMs = 400;
  double proxy_mm = 1, from_mm3 = 0, press_n = 0;
  for (int ms = 0; ms < kMs; ++ms) {
    if (ms == kSettleMs) from_mm3 = miller.removed_mm3();
    const double down_mm = grams * kNewtonsPerGram / scene.force.stiffness_n_per_mm;
    const ServoOutput out = miller.step({-std::cos(0.015 * ms), proxy_mm - down_mm, 0});
    proxy_mm = out.position_mm[1] + out.proxy_offset_mm[1];
    if (ms >= kSettleMs) press_n += out.press_n / (kMs - kSettleMs);
  }
  return {(miller.removed_mm3() - from_mm3) * 1000 / (kMs - kSettleMs), press_n};
}

}  // namespace

TEST_CASE("medium grit cuts alike at 100 to 400 krpm; by Preston's law it would not") {
  std::array<double, 4> grit{}, preston{};
  for (std::size_t i = 0; i < grit.size(); ++i) {
    const double krpm = 100.0 * static_cast<double>(i + 1);
    grit[i] = under(75, Grit::medium, krpm).mm3_per_s;
    preston[i] = under(75, Grit::none, krpm).mm3_per_s;
    MESSAGE(krpm, " krpm, 75 g: medium grit ", grit[i], " mm3/s, Preston ", preston[i]);
  }
  CHECK(grit[3] / grit[0] == doctest::Approx(1).epsilon(0.03));
  CHECK(preston[3] / preston[0] > 3);
}

TEST_CASE(
    "from 100 g on medium grit gains nothing, coarse grit does; both are within the bench's") {
  constexpr std::array kGrams{44.0, 100.0, 147.5, 183.0};
  std::array<Rate, kGrams.size()> medium{}, coarse{};
  for (std::size_t i = 0; i < kGrams.size(); ++i) {
    medium[i] = under(kGrams[i], Grit::medium, 300);
    coarse[i] = under(kGrams[i], Grit::coarse, 300);
    MESSAGE(kGrams[i], " g (", medium[i].press_n, " N): medium ", medium[i].mm3_per_s,
            " mm3/s, coarse ", coarse[i].mm3_per_s);
  }
  CHECK(medium[0].mm3_per_s < 0.5 * medium[1].mm3_per_s);
  CHECK(medium[2].mm3_per_s == doctest::Approx(medium[1].mm3_per_s).epsilon(0.03));
  CHECK(medium[3].mm3_per_s == doctest::Approx(medium[1].mm3_per_s).epsilon(0.03));
  CHECK(coarse[3].mm3_per_s > 1.5 * coarse[1].mm3_per_s);
  // 3.3 to 5.3 mm^3/s, at a load that was not published.
  CHECK(medium[1].mm3_per_s > 3.3);
  CHECK(medium[1].mm3_per_s < 5.3);
}

TEST_CASE(
    "60 s of preparation warm the pulp as published, dry and with water, and feed back nowhere") {
  constexpr double kKrpm = 200, kGrams = 75;
  const LoadedScene scene = bench(Grit::medium, kKrpm, 0.7);
  CuttingHand miller(scene, {-1, 1, 0});
  const HeatingSpindle spindle{scene.spindle.stall_torque_n_mm, kReferenceSpeedKrpm};
  constexpr int kSettleMs = 100, kMs = 500;
  double proxy_mm = 0.7, power_w = 0;
  for (int ms = 0; ms < kMs; ++ms) {
    const double down_mm = kGrams * kNewtonsPerGram / scene.force.stiffness_n_per_mm;
    const ServoOutput out = miller.step({-std::cos(0.015 * ms), proxy_mm - down_mm, 0});
    proxy_mm = out.position_mm[1] + out.proxy_offset_mm[1];
    if (ms < kSettleMs) continue;
    power_w += spindle.power_w(out.spindle_load, out.spindle_ratio) / (kMs - kSettleMs);
  }
  const auto after_60_s = [&](std::optional<double> water_c) {
    PulpHeat pulp(spindle, water_c, 0.01);
    constexpr double kRatio = kKrpm / kReferenceSpeedKrpm;
    for (int i = 0; i < 6000; ++i) {
      pulp.add(power_w / spindle.power_w(1, kRatio), kRatio);
      pulp.advance();
    }
    return pulp.rise_c();
  };
  struct Mean {
    std::optional<double> water_c;
    double rise_c;
  };
  constexpr std::array<Mean, 4> kPublished{{{{}, 6.8}, {10.0, -16.3}, {23.0, -8.6}, {35.0, 1.6}}};
  for (const auto& [water_c, published_c] : kPublished) {
    const double rise_c = after_60_s(water_c);
    MESSAGE(power_w, " W, water ", water_c.value_or(-1), ": ", rise_c, " C, published ",
            published_c);
    CHECK(std::abs(rise_c - published_c) < 0.5 * std::abs(published_c));
  }
}

TEST_CASE("39 mm of ceramic at 147.5 g take half, 35 and 25 % of the rate of the three grits") {
  // A groove of 1.4 mm by 6 mm: bur diameter and depth were not published, and are chosen.
  constexpr double kSectionMm2 = 8.4, kPathMm = 39, kLoadN = 147.5 * kNewtonsPerGram;
  constexpr double kMm3PerSN = kEnamelMm3PerSN * 53, kRateHz = 1000;
  constexpr std::array kGrits{Grit::medium, Grit::coarse, Grit::super_coarse};
  constexpr std::array kLost{0.50, 0.35, 0.25};
  for (std::size_t i = 0; i < kGrits.size(); ++i) {
    const BurLaw bur = grit_law(kGrits[i]);
    const auto law = cut_law<DoubleNumbers>({.threshold_n = 0.05,
                                             .force_exponent = bur.force_exponent,
                                             .speed_exponent = bur.speed_exponent,
                                             .largest_n = bur.saturation_n,
                                             .wear_half_n_s = bur.wear_half_n_s},
                                            kRateHz);
    BurWear<DoubleNumbers> wear;
    double cut_mm3 = 0;
    const double sharp = cut_drive<DoubleNumbers>(law, kLoadN, 1);
    while (cut_mm3 < kSectionMm2 * kPathMm) {
      cut_mm3 += kMm3PerSN * wear.left_of(sharp, law) / kRateHz;
      wear.add(sharp);
    }
    MESSAGE("lost ", 1 - wear.sharpness(law), ", published ", kLost[i]);
    CHECK(std::abs(1 - wear.sharpness(law) - kLost[i]) < 0.02);
  }
}

}  // namespace kerf::grit_test
