// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/extreme_measures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string_view>

#include "controller/plan/compile.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/ranges/count_hand.hpp"
#include "lab/ranges/hard_hand.hpp"
#include "lab/rig/body.hpp"
#include "shared/numeric/fixed.hpp"
#include "shared/text/format.hpp"

namespace kerf::ranges {
namespace {

using DensityAt = std::function<double(extremes::Point)>;

/// A volume of 32^3 voxels about the origin, solid by its share, and a ball of 4 voxels above it.
LoadedScene scene_of(NumericKind numeric, ForceModel model, std::array<double, 3> spacing_mm,
                     const DensityAt& share) {
  constexpr std::int32_t kEdge = 32;
  LoadedScene scene;
  scene.path = "lab";
  scene.servo.numeric = numeric;
  scene.force.model = model;
  scene.cut.model = CutModel::none;
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  SceneVolume& volume = scene.volumes.emplace_back();
  volume.name = "field";
  const extremes::Body body = extremes::body_of({kEdge, kEdge, kEdge}, share);
  volume.image.grid = body.grid;
  volume.image.density = body.density;
  volume.image.spacing_mm = spacing_mm;
  for (std::size_t i = 0; i < 3; ++i) volume.pose.position_mm[i] = -spacing_mm[i] * (kEdge - 1) / 2;
  const double voxel_mm = std::ranges::min(spacing_mm);
  scene.tools.push_back(
      make_tool("ball", "ball", {.pitch_mm = voxel_mm, .radius_mm = 4 * voxel_mm}));
  scene.device.workspace_scale = voxel_mm / 0.25;  // the hand feels voxels of 0.25 mm
  return scene;
}

/// Solid below the middle along y, its edge two voxels wide.
double solid_half(extremes::Point p) {
  return 0.5 - (p[1] - 15.5) / 2;
}

constexpr std::uint64_t kAnyWork = std::numeric_limits<std::int64_t>::max();

std::string key_found(std::string_view name, const std::vector<KeyRow>& keys, Found& found) {
  const auto row =
      std::ranges::find(keys, name, [](const KeyRow& r) { return r.levels.key->name; });
  if (row == keys.end() || row->levels.beyond.empty() || row->ends.ran == 0) {
    found.push_back({"ran", std::string(name) + " has no end that runs"});
    return {};
  }
  for (const Broken& broken : row->ends.broken) found.push_back(broken.violation);
  return std::string(name) + ": " + std::to_string(row->ends.ran) + " ends ran, " +
         std::to_string(row->beyond_refused) + " beyond refused";
}

struct Field {
  const char* name;
  DensityAt share;
  bool silent;  ///< gives no force at all
};

/// A hand of 145 g, 3.2 N s/m and 0.2 N/mm rests on the flat behind an encoder of this quantum, in
/// steps of 1/100 of a tick; peak to peak of its last third.
double rest_cycle_mm(NumericKind numeric, double quantum_mm) {
  constexpr double kMassKg = 0.145, kDampingNsPerMm = 0.0032, kHandNPerMm = 0.2, kAimMm = -3;
  constexpr int kTicks = 900, kSteps = 100;
  constexpr double kDt = 1e-3 / kSteps;
  LoadedScene scene = scene_of(numeric, ForceModel::proxy, {0.25, 0.25, 0.25}, solid_half);
  CountHand hand(scene.device);
  const auto servo = compile(scene);
  const double start_mm = 1.2;
  const auto report_at = [&](double y_mm) {
    const double y = quantum_mm > 0 ? std::floor(y_mm / quantum_mm) * quantum_mm : y_mm;
    return hand.report(hand.counts_at({0, y, 0}), false);
  };
  const CountHand::Counts dock{}, top = hand.counts_at({0, start_mm, 0});
  for (int i = 0; i < 60; ++i) static_cast<void>(servo->step(hand.report(dock, true)));
  for (int i = 1; i <= 100; ++i) {
    const double s = i / 100.0;
    static_cast<void>(servo->step(hand.report({s * top[0], s * top[1], s * top[2]}, true)));
  }
  for (int i = 0; i < 110; ++i) static_cast<void>(servo->step(report_at(start_mm)));
  double y_mm = start_mm, v_mm_per_s = 0, low = 1e9, high = -1e9;
  for (int tick = 0; tick < kTicks; ++tick) {
    const double force_n = servo->step(report_at(y_mm)).force_n[1];
    for (int step = 0; step < kSteps; ++step) {
      const double push_n = force_n + kHandNPerMm * (kAimMm - y_mm) - kDampingNsPerMm * v_mm_per_s;
      v_mm_per_s += push_n / kMassKg * 1000 * kDt;
      y_mm += v_mm_per_s * kDt;
    }
    if (tick < kTicks * 2 / 3) continue;
    low = std::min(low, y_mm);
    high = std::max(high, y_mm);
  }
  return high - low;
}

}  // namespace

std::string measure_stiffness(const Effort& effort, const std::vector<KeyRow>& keys, Found& found) {
  for (const NumericKind numeric : effort.numerics) {
    LoadedScene scene = scene_of(numeric, ForceModel::paper, {0.25, 0.25, 0.25}, solid_half);
    scene.force.p0_n_per_mm2 = 0;
    const HardHand hand = hard_hand(scene);
    const auto servo = compile(scene);
    for (const DeviceReport& report : hand.reports) {
      if (servo->step(report).force_n == std::array<double, 3>{}) continue;
      found.push_back({"zero", "a stiffness of 0 gives a force"});
      break;
    }
  }
  return key_found("force.stiffness_n_per_mm", keys, found);
}

std::string measure_damping(const Effort&, const std::vector<KeyRow>& keys, Found& found) {
  return key_found("force.damping_ns_per_mm", keys, found);
}

/// At rest in the flat, some three voxels deep: force over stiffness times depth.
std::string measure_voxel_sizes(const Effort& effort, const std::vector<KeyRow>&, Found& found) {
  double worst = 0;
  for (const NumericKind numeric : effort.numerics) {
    for (const std::array<double, 3>& mm : {std::array{0.01, 0.01, 0.01},
                                            {0.1, 0.1, 0.1},
                                            {0.5, 0.5, 0.5},
                                            {2.0, 2.0, 2.0},
                                            {0.1, 0.4, 0.1},
                                            {0.4, 0.1, 0.4}}) {
      LoadedScene scene = scene_of(numeric, ForceModel::proxy, mm, solid_half);
      const double scale = scene.device.workspace_scale, stiffness = scene.force.stiffness_n_per_mm;
      const double radius_mm = scene.tools[0].radius_mm;
      const HardHand hand = hard_hand(scene);
      const auto servo = compile(scene);
      ServoOutput out;
      for (const DeviceReport& report : hand.reports) out = servo->step(report);
      const auto held = hand.reports.back();
      for (int tick = 0; tick < 200; ++tick) out = servo->step(held);
      const double depth_mm = (radius_mm - out.position_mm[1]) / scale;
      const double error = std::abs(out.force_n[1] / (stiffness * depth_mm) - 1);
      worst = std::max(worst, error);
      // A twentieth of a voxel of the coarsest edge, of the depth, and the normal's 1 %.
      const double blur = 0.05 * std::ranges::max(mm) / scale / depth_mm + 0.01;
      if (!(depth_mm > 0) || !(error <= blur)) {
        found.push_back(
            {"invariant", format("%.3g mm: force off by %.3g of K depth", mm[1], error)});
      }
    }
  }
  return format("force within %.2g of K depth", worst);
}

std::string measure_fields(const Effort& effort, const std::vector<KeyRow>&, Found& found) {
  const std::array<Field, 4> all{{
      {"empty", [](extremes::Point) { return 0.0; }, true},
      {"full", [](extremes::Point) { return 1.0; }, false},
      {"checkerboard",
       [](extremes::Point p) { return double((int(p[0]) + int(p[1]) + int(p[2])) % 2); }, false},
      {"single voxel",
       [](extremes::Point p) {
         return p == extremes::Point{16, 16, 16} ? 1.0 : 0.0;
       },
       false},
  }};
  double largest_n = 0;
  for (const NumericKind numeric : effort.numerics) {
    for (const ForceModel model : {ForceModel::paper, ForceModel::proxy}) {
      for (const Field& field : all) {
        LoadedScene scene = scene_of(numeric, model, {0.25, 0.25, 0.25}, field.share);
        const HardHand hand = hard_hand(scene);
        const auto servo = compile(scene);
        Rules rules(scene, kAnyWork);
        double most_n = 0;
        for (const DeviceReport& report : hand.reports) {
          const ServoOutput out = servo->step(report);
          rules.look_at(report, out);
          most_n = std::max({most_n, std::abs(out.force_n[0]), std::abs(out.force_n[1]),
                             std::abs(out.force_n[2])});
        }
        for (const Violation& violation : rules.violations())
          found.push_back({violation.rule, field.name + (": " + violation.what)});
        if (field.silent && most_n > 0) found.push_back({"empty", "an empty volume gives a force"});
        largest_n = std::max(largest_n, most_n);
      }
    }
  }
  return format("largest force %.3g N", largest_n);
}

std::string measure_quantum(const Effort& effort, const std::vector<KeyRow>&, Found& found) {
  constexpr double kCountMm = 0.056;  // of an Omni, whose counts follow the quantum
  double worst = 0;
  for (const NumericKind numeric : effort.numerics) {
    for (const double mm : {0.0, 0.001, 0.055, 1.0}) {
      const double cycle_mm = rest_cycle_mm(numeric, mm),
                   of_quantum = cycle_mm / std::max(mm, kCountMm);
      worst = std::max(worst, of_quantum);
      if (!(of_quantum <= 3))
        found.push_back({"cycle", format("D = %.3g mm: %.3g mm peak to peak", mm, cycle_mm)});
    }
  }
  return format("at most %.2g quanta peak to peak", worst);
}

/// In a float servo a heat that decays for 20 minutes at 250 Hz comes below 2^-126.
std::string measure_denormals(const Effort&, const std::vector<KeyRow>&, Found& found) {
  constexpr int kTicks = 300'000;
  LoadedScene scene =
      scene_of(NumericKind::float32, ForceModel::proxy, {0.25, 0.25, 0.25}, solid_half);
  scene.servo.rate_hz = 250;
  const HardHand hand = hard_hand(scene);
  const auto servo = compile(scene);
  for (const DeviceReport& report : hand.reports) static_cast<void>(servo->step(report));
  // Up, out of the solid: the motors stay on, without force.
  CountHand still(scene.device);
  const DeviceReport rest = still.report(still.counts_at({0, 10, 0}), false);
  int subnormal = 0;
  ServoOutput out;
  for (int tick = 0; tick < kTicks; ++tick) {
    out = servo->step(rest);
    for (const auto& list : {out.force_n, out.contact_n, out.velocity_mm_per_s, out.torque_n_mm}) {
      for (const double x : list)
        subnormal += x != 0 && std::abs(x) < std::numeric_limits<float>::min() ? 1 : 0;
    }
  }
  if (subnormal > 0) found.push_back({"denormal", format("%d outputs are subnormal", subnormal)});
  return format("%d ticks of 250 Hz, none subnormal", kTicks);
}

std::string measure_energy(const Effort&, const std::vector<KeyRow>&, Found& found) {
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max(),
                 kLeast = std::numeric_limits<std::int64_t>::min();
  if (saturating_add(kMost, 1) != kMost || saturating_add(kLeast, -1) != kLeast) {
    found.push_back({"saturates", "the ledger's sum wraps"});
  }
  return "the sum of 64 bits stays at its ends";
}

}  // namespace kerf::ranges
