// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/ranges/extreme_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "controller/plan/compile.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/text/text.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/rig/kinematic_hand.hpp"
#include "tests/studies/ranges/combination.hpp"
#include "tests/studies/ranges/key_study.hpp"

namespace kerf::ranges {
namespace {

// The measurements: each returns its finding, and adds each violation to `found`. `keys` are the
// rows of `study_keys`.

using Found = std::vector<Violation>;

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
  KinematicHand hand(scene.device);
  const auto servo = compile(scene);
  const double start_mm = 1.2;
  const auto report_at = [&](double y_mm) {
    const double y = quantum_mm > 0 ? std::floor(y_mm / quantum_mm) * quantum_mm : y_mm;
    return hand.report(hand.counts_at({0, y, 0}), false);
  };
  const KinematicHand::Counts dock{}, top = hand.counts_at({0, start_mm, 0});
  for (int i = 0; i < 60; ++i) static_cast<void>(servo->step(hand.report(dock, true)));
  for (int i = 1; i <= 100; ++i) {
    const double s = i / 100.0;
    static_cast<void>(servo->step(hand.report({s * top[0], s * top[1], s * top[2]}, true)));
  }
  for (int i = 0; i < 110; ++i) static_cast<void>(servo->step(report_at(start_mm)));
  double y_mm = start_mm, v_mm_per_s = 0, low = 1e9, high = -1e9;
  for (int tick = 0; tick < kTicks; ++tick) {
    const double force_n = servo->step(report_at(y_mm)).commanded_force_n[1];
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

std::string measure_stiffness(const StudySize& effort, const std::vector<KeyRow>& keys,
                              Found& found) {
  for (const NumericKind numeric : effort.numerics) {
    LoadedScene scene = scene_of(numeric, ForceModel::paper, {0.25, 0.25, 0.25}, solid_half);
    scene.force.p0_n_per_mm2 = 0;
    const StressInput hand = hard_hand(scene);
    const auto servo = compile(scene);
    for (const DeviceReport& report : hand.reports) {
      if (servo->step(report).commanded_force_n == std::array<double, 3>{}) continue;
      found.push_back({"zero", "a stiffness of 0 gives a force"});
      break;
    }
  }
  return key_found("force.stiffness_n_per_mm", keys, found);
}

std::string measure_damping(const StudySize&, const std::vector<KeyRow>& keys, Found& found) {
  return key_found("force.damping_ns_per_mm", keys, found);
}

/// At rest in the flat, some three voxels deep: force over stiffness times depth.
std::string measure_voxel_sizes(const StudySize& effort, const std::vector<KeyRow>&, Found& found) {
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
      const StressInput hand = hard_hand(scene);
      const auto servo = compile(scene);
      ServoOutput out;
      for (const DeviceReport& report : hand.reports) out = servo->step(report);
      const auto held = hand.reports.back();
      for (int tick = 0; tick < 200; ++tick) out = servo->step(held);
      const double depth_mm = (radius_mm - out.position_mm[1]) / scale;
      const double error = std::abs(out.commanded_force_n[1] / (stiffness * depth_mm) - 1);
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

std::string measure_fields(const StudySize& effort, const std::vector<KeyRow>&, Found& found) {
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
        const StressInput hand = hard_hand(scene);
        const auto servo = compile(scene);
        Rules rules(scene, kAnyWork);
        double most_n = 0;
        for (const DeviceReport& report : hand.reports) {
          const ServoOutput out = servo->step(report);
          rules.look_at(report, out);
          most_n =
              std::max({most_n, std::abs(out.commanded_force_n[0]),
                        std::abs(out.commanded_force_n[1]), std::abs(out.commanded_force_n[2])});
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

std::string measure_quantum(const StudySize& effort, const std::vector<KeyRow>&, Found& found) {
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

/// In a servo of doubles a heat that decays for 2.5 hours at 250 Hz comes below 2^-1022: e^(-t / 10
/// s).
std::string measure_denormals(const StudySize&, const std::vector<KeyRow>&, Found& found) {
  constexpr int kTicks = 2'250'000;
  LoadedScene scene =
      scene_of(NumericKind::float64, ForceModel::paper, {0.25, 0.25, 0.25}, solid_half);
  scene.servo.rate_hz = 250;
  const StressInput hand = hard_hand(scene);
  const auto servo = compile(scene);
  for (const DeviceReport& report : hand.reports) static_cast<void>(servo->step(report));
  // Up, out of the solid: the motors stay on, without force.
  KinematicHand still(scene.device);
  const DeviceReport rest = still.report(still.counts_at({0, 10, 0}), false);
  int subnormal = 0;
  ServoOutput out;
  for (int tick = 0; tick < kTicks; ++tick) {
    out = servo->step(rest);
    for (const auto& list :
         {out.commanded_force_n, out.contact_force_n, out.velocity_mm_per_s, out.torque_n_mm}) {
      for (const double x : list)
        subnormal += x != 0 && std::abs(x) < std::numeric_limits<double>::min() ? 1 : 0;
    }
  }
  if (subnormal > 0) found.push_back({"denormal", format("%d outputs are subnormal", subnormal)});
  return format("%d ticks of 250 Hz, none subnormal", kTicks);
}

std::string measure_energy(const StudySize&, const std::vector<KeyRow>&, Found& found) {
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max(),
                 kLeast = std::numeric_limits<std::int64_t>::min();
  if (saturating_add(kMost, 1) != kMost || saturating_add(kLeast, -1) != kLeast) {
    found.push_back({"saturates", "the ledger's sum wraps"});
  }
  return "the sum of 64 bits stays at its ends";
}

const std::array kRows{
    ExtremeRow{"stiffness",
               "0 gives no force; both ends keep every rule; beyond, and no number, are refused",
               measure_stiffness,
               {}},
    ExtremeRow{
        "damping",
        "both ends keep every rule; beyond, no number, and what no stiffness bears are refused",
        measure_damping,
        {{"plan/gain_margin_test.cpp",
          "a damping that no stiffness bears is named with its own bound"}}},
    ExtremeRow{
        "velocity",
        "no wall is passed; faster than the limit has no motors in the same tick",
        nullptr,
        {{"proxy/iso_test.cpp", "walls of low iso hold a ball and a turning cylinder"},
         {"servo/servo_safety_test.cpp", "faster than 10 m/s: motors off in the same tick"},
         {"servo/velocity_window_test.cpp",
          "whatever the places, the velocity is theirs within the range, and fixed is double"}}},
    ExtremeRow{
        "mass of the emulator",
        "a free mass of any size follows its parabola; the map scales with it",
        nullptr,
        {{"hil/plant_test.cpp", "a free mass under a constant force follows the parabola"},
         {"stability/stable_gains_test.cpp",
          "the region scales with m/T and m/T^2, and each boundary parts stable from unstable"}}},
    ExtremeRow{
        "quantum", "no limit cycle above 3 quanta at the default stiffness", measure_quantum, {}},
    ExtremeRow{"voxel size",
               "0.01 to 2 mm and 1:4: force is stiffness times depth, within the blur",
               measure_voxel_sizes,
               {}},
    ExtremeRow{
        "density",
        "empty gives no force; full, checkerboard and one voxel keep every rule; NaN is refused",
        measure_fields,
        {{"volume/read_test.cpp",
          "what is not one finite grey value per voxel of three axes at right angles is refused"}}},
    ExtremeRow{"zero gradient",
               "a start in the solid is pushed out by a ramp, or refused; the paper's force is 0",
               nullptr,
               {{"proxy/proxy_contact_test.cpp",
                 "a start inside of the solid ends outside, by a force that grows"},
                {"proxy/proxy_contact_test.cpp",
                 "a start with nothing free near is refused, until the hand is out"},
                {"servo/servo_step_test.cpp", "no force in the air, none when immersed"}}},
    ExtremeRow{
        "tool size",
        "one more sample than the limit, and larger than the volume, are refused",
        nullptr,
        {{"tool/tool_shapes_test.cpp",
          "the largest tool has exactly the largest number of samples per side"},
         {"load/scene_load_test.cpp",
          "a tool that does not suit the volume is reported with its line and the numbers"},
         {"load/scene_load_test.cpp",
          "a tool with more surface than contact can read is reported with the scene and count"}}},
    ExtremeRow{"position",
               "outside is free; far goals and counts at their ends are bounded work and finite",
               nullptr,
               {{"servo/border_test.cpp",
                 "on a solid that ends at the volume's border a tool rests, slides and cuts"},
                {"proxy/proxy_contact_test.cpp", "a far goal is bounded work and a finite force"},
                {"servo/servo_safety_test.cpp",
                 "whatever counters and pots read, the tool keeps its size and the force its "
                 "limit"}}},
    ExtremeRow{"packets",
               "no number, stale, repeated: held 5 ms, gone at 20 ms, fault latched",
               nullptr,
               {{"servo/servo_safety_test.cpp",
                 "reports stop: the force holds 5 ms, is zero at 20 ms, motors off, fault latched"},
                {"servo/servo_safety_test.cpp",
                 "a pose that is not finite: motors off after 2 ms, until the device was parked"},
                {"proxy/proxy_contact_test.cpp",
                 "a goal that is no number gives no force and changes nothing"}}},
    ExtremeRow{"jump",
               "faster than the limit in one tick: motors off, latched",
               nullptr,
               {{"servo/servo_safety_test.cpp", "faster than 10 m/s: motors off in the same tick"},
                {"servo/servo_safety_test.cpp",
                 "one packet with the docked bit neither moves the tip nor forgives a fault"}}},
    ExtremeRow{
        "jitter",
        "missed deadlines are skipped, never caught up; a stall fades in anew",
        nullptr,
        {{"shell/loop_test.cpp",
          "deadlines keep their distance, and missed ones are skipped and counted"},
         {"shell/loop_test.cpp",
          "a servo that stands still for 20 ms loses its motors, once per stall"},
         {"servo/servo_safety_test.cpp", "after a stall the force starts again from nothing"}}},
    ExtremeRow{"force step",
               "slew and clamp hold from any force to any other",
               nullptr,
               {{"servo/force_limits_test.cpp",
                 "whatever is wanted, peak and slew hold, also from the ends of the number range"},
                {"servo/servo_safety_test.cpp",
                 "a very stiff scene meets every limit and keeps the force below 3.3 N"}}},
    ExtremeRow{
        "accumulation",
        "what leaves the volume and what is owed are all that was computed",
        nullptr,
        {{"kernel/milling_test.cpp",
          "what leaves the volume and what the carry holds are together all that was computed"},
         {"kernel/milling_test.cpp",
          "20 000 slow ticks remove what they should, though each is less than a density step"}}},
    ExtremeRow{
        "reader",
        "a reader that is slow, dead or too many disturbs nobody",
        nullptr,
        {{"segment/mirror_test.cpp", "a slow reader skips ticks and never bricks"},
         {"segment/hand_over_test.cpp", "one reader too many is refused and the others stay"},
         {"shell/clean_loop_test.cpp",
          "the loop is clean: no allocation, no page fault, one call per sleep and packet"}}},
    ExtremeRow{"energy", "the ledger stays at the ends of its range", measure_energy, {}},
    ExtremeRow{"denormals",
               "no output is subnormal, after a force and after 2.5 hours of rest",
               measure_denormals,
               {}},
    ExtremeRow{
        "thermal",
        "a peak held for long settles at the continuous force",
        nullptr,
        {{"servo/force_limits_test.cpp", "a peak held for long settles at the continuous force"}}},
};

}  // namespace

std::span<const ExtremeRow> extreme_rows() {
  return kRows;
}

}  // namespace kerf::ranges
