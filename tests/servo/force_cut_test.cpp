// SPDX-License-Identifier: Apache-2.0
// Cutting by force in the whole servo step: from joint counts to removed volume and felt friction.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/phantom.hpp"
#include "tests/case_count.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::force_cut_test {

using namespace kerf::test;
using extremes::RandomNumbers, extremes::CuttingHand, extremes::sink, extremes::SunkForce;

namespace {

using Shape = std::function<double(double, double, double)>;

double flat(double, double y_mm, double) {
  return y_mm;
}

/// A solid with an edge over two voxels, milled by a ball of radius 1 mm.
LoadedScene mill_scene(const Shape& signed_distance_mm = flat, int edge = 48) {
  LoadedScene scene = half_space_scene(8);
  scene.volumes[0] = volume_of(edge, kVoxelMm, [&](double x, double y, double z) {
    return signed_distance_mm(x, y, z) / 2;
  });
  scene.cut.model = CutModel::preston;
  scene.cut.threshold_n = 0.0625;  // that every kind of numbers holds
  return scene;
}

/// Part of `force` along `normal`.
double along(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace

// F11
TEST_CASE("what the servo removes is the integral of G F") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const double scale : {1.0, 0.5}) {
      CAPTURE(static_cast<int>(numeric));
      CAPTURE(scale);
      LoadedScene scene = mill_scene();
      scene.servo.numeric = numeric;
      scene.device.workspace_scale = scale;
      scene.cut.machinability_mm3_per_s_n = 8;  // so that what is carried is a millionth of it all
      CuttingHand miller(scene, {0, 1.3 / scale, 0});
      for (int ms = 0; ms < 1000; ++ms) {
        miller.step({0.3 * std::sin(0.01 * ms), (0.8 - 0.0025 * ms) / scale, 0});
      }
      CHECK(miller.removed_mm3() > 2);
      CHECK(std::abs(miller.removed_mm3() / miller.fed_mm3() - 1) < 1e-6);
    }
  }
}

TEST_CASE("what the servo removes is the integral of its bur's law, saturated and worn") {
  constexpr BurLaw kMedium{.speed_exponent = 0, .saturation_n = 0.5, .wear_half_n_s = 0.3};
  constexpr BurLaw kBent{.force_exponent = 1.5, .speed_exponent = 0.29, .wear_half_n_s = 0.5};
  for (const BurLaw& law : {kMedium, kBent}) {
    for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
      for (const int rate_hz : {1000, 4000}) {
        CAPTURE(law.force_exponent);
        CAPTURE(static_cast<int>(numeric));
        CAPTURE(rate_hz);
        LoadedScene scene = mill_scene();
        scene.servo.numeric = numeric;
        scene.servo.rate_hz = rate_hz;
        scene.cut.machinability_mm3_per_s_n = 8;
        scene.tools[0].law = law;
        CuttingHand miller(scene);
        ServoOutput out;
        for (int i = 0; i < rate_hz; ++i) {
          const double ms = 1000.0 * i / rate_hz;
          out = miller.step({0.3 * std::sin(0.01 * ms), 0.8 - 0.0025 * ms, 0});
        }
        CHECK(out.sharpness < 0.7);
        CHECK(miller.removed_mm3() > 1);
        CHECK(std::abs(miller.removed_mm3() / miller.fed_mm3() - 1) < 3e-5);
      }
    }
  }
}

// F12
TEST_CASE("a spindle that stands removes nothing and rubs nothing") {
  LoadedScene scene = mill_scene();
  scene.spindle.speed_krpm = 0;
  CuttingHand miller(scene);
  const ServoOutput out = miller.hold({0, -0.5, 0}, 0.1);
  CHECK(out.press_n > 0.5);
  CHECK(out.spindle_ratio == 0);
  CHECK(out.spindle_load == 0);
  CHECK(length(out.modification_n) == 0);
  CHECK(miller.removed_mm3() == 0);
}

TEST_CASE("the spindle runs up, slows down under load and is braked by a hold") {
  CuttingHand miller(mill_scene());
  const ServoOutput running = miller.step({0, 1.3, 0});
  CHECK(running.spindle_ratio == doctest::Approx(1).epsilon(0.01));
  CHECK(running.spindle_load == 0);
  const ServoOutput pressed = miller.hold({0, -1, 0}, 0.3);
  CHECK(pressed.spindle_load > 0.02);
  CHECK(pressed.spindle_ratio == doctest::Approx(1 - pressed.spindle_load).epsilon(0.01));
  miller.servo().apply({ServoCommand::Kind::hold, 1});
  const double before_mm3 = miller.removed_mm3();
  CHECK(miller.hold({0, -1, 0}, 0.5).spindle_ratio < 0.01);
  CHECK(miller.removed_mm3() == before_mm3);
}

TEST_CASE("friction pulls against a bur that turns clockwise, by its part of the press") {
  CuttingHand miller(mill_scene());
  const ServoOutput out = miller.hold({0, 0, 0}, 0.05);
  // The face lies at -y of the centre: omega x r with omega along minus the shaft is R a x y.
  const std::array<double, 3> shaft{out.rotation[1], out.rotation[4], out.rotation[7]};
  std::array<double, 3> moves{-shaft[2], 0, shaft[0]};
  const double across = length(moves);
  REQUIRE(across > 0.2);  // the stylus leans, else the pole would touch
  for (double& x : moves) x /= across;
  const double friction_n = -along(out.modification_n, moves);
  CHECK(friction_n > 0.25 * out.press_n);
  CHECK(friction_n < 0.5 * out.press_n);
  CHECK(length(out.modification_n) < 1.05 * friction_n);
  CHECK(std::abs(out.commanded_force_n[1] - out.press_n) <
        0.05 * out.press_n);  // friction does not press
}

TEST_CASE("friction does not press a ball in its own bore") {
  LoadedScene scene = mill_scene(flat, 64);
  scene.cut.machinability_mm3_per_s_n = 0.5;
  CuttingHand miller(scene);
  static_cast<void>(miller.hold({0, -1, 0}, 1));
  double pressed = 0, largest = 0;
  for (int ms = 0; ms < 1000; ++ms) {
    const double turn = 0.005 * ms;
    const ServoOutput out = miller.step({0.4 * std::sin(turn), -1, 0.4 * std::cos(turn)});
    const double along_load_n =
        along(out.modification_n, out.contact_force_n) / length(out.contact_force_n);
    pressed = std::max(pressed, std::abs(along_load_n) / out.press_n);
    largest = std::max(largest, length(out.modification_n) / out.press_n);
  }
  MESSAGE("friction along the load at most ", pressed, " of the press, and ", largest, " in all");
  CHECK(largest > 0.1);
  CHECK(pressed < 0.02);
}

TEST_CASE("a forbidden material is told and never cut") {
  LoadedScene scene = mill_scene();
  scene.materials = default_materials();
  scene.materials[kLabelPulp].forbidden = true;
  scene.cut.machinability_mm3_per_s_n = 8;
  VolumeImage& image = scene.volumes[0].image;
  const VoxelGrid grid = image.grid;
  for (int i = 0; i < int(grid.voxel_count()); ++i) {
    image.labels.push_back(i / grid.nx % grid.ny < 18 ? kLabelPulp : kLabelEnamel);
  }
  const std::vector<Label> labels = image.labels;
  const std::vector<Density> before = image.density;
  CuttingHand miller(scene);
  scene = {};  // the servo keeps the labels that it needs
  CHECK_FALSE(miller.hold({0, 0.6, 0}, 0.01).forbidden);
  CHECK(miller.hold({0, -1.5, 0}, 0.5).forbidden);
  CHECK(miller.removed_mm3() > 0.5);
  const auto after = miller.servo().density(0);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (labels[i] == kLabelPulp) REQUIRE(after[i] == before[i]);
  }
}

TEST_CASE("the press is shared by two volumes, whatever their voxels") {
  // The same solid twice, the second time on voxels of twice the length along z, and turned half
  // round.
  LoadedScene scene = mill_scene();
  scene.volumes.push_back(scene.volumes[0]);
  SceneVolume& second = scene.volumes[1];
  VolumeImage& image = second.image;
  image.grid.nz /= 2;
  image.spacing_mm[2] *= 2;
  image.density.resize(image.grid.voxel_count());  // it is the same on every plane
  std::reverse(image.density.begin(), image.density.end());
  const double corner = -second.pose.position_mm[0];
  second.pose = {{corner, corner, -corner}, {0, 0, 1, 0}};
  CuttingHand miller(scene);
  std::array<std::uint64_t, 2> steps{};
  for (int ms = 0; ms < 600; ++ms) {
    const ServoOutput out = miller.step({0, 0.8 - 0.002 * ms, 0});
    for (std::size_t v = 0; v < 2; ++v) steps[v] += out.removed_by_volume[v];
  }
  CHECK(std::abs(miller.removed_mm3() / miller.fed_mm3() - 1) < 1e-3);
  // Nearly the same volume of both, though half as many voxels.
  CHECK(double(steps[0]) / double(2 * steps[1]) == doctest::Approx(1).epsilon(0.2));
}

// What a CT of a tooth gives in 8 bits: of the range up to enamel the iso is a fifth, so that noise
// and steps of the voxels count more than twice in the density of contact.
// At the four of 51 places of the valley where it once stepped most, and at six others.
TEST_CASE("milling into a noisy valley changes the force by less than 2 % a tick") {
  constexpr int kEdge = 64;
  constexpr double kIsoShare = 0.2, kNoise = 0.02, kLevels = 255;
  const Shape valley = [](double x, double y, double z) {
    return 0.75 * std::max(y - 0.2 - std::abs(0.6 * x + 0.3 * z), y - 1);
  };
  LoadedScene scene = mill_scene(valley, kEdge);
  scene.cut.threshold_n = LoadedScene{}.cut.threshold_n;
  SceneVolume& volume = scene.volumes[0];
  volume.iso = static_cast<Density>(kIsoShare * kDensityMax);
  RandomNumbers random(9);
  std::size_t voxel = 0;
  const double corner = volume.pose.position_mm[0];
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const double depth_vox =
            -valley(corner + x * kVoxelMm, corner + y * kVoxelMm, corner + z * kVoxelMm) / kVoxelMm;
        const double spread = std::sqrt(-2 * std::log(random.uniform(1e-12, 1)));
        const double noise = spread * std::cos(2 * std::numbers::pi * random.uniform(0, 1));
        const double share = 0.5 * std::erfc(-depth_vox / std::sqrt(2.0)) + kNoise * noise;
        const double level = std::round(kLevels * std::clamp(share, 0.0, 1.0)) / kLevels;
        volume.image.density[voxel++] = static_cast<Density>(std::lround(kDensityMax * level));
      }
    }
  }
  scene.force.damping_ns_per_mm = 0;
  constexpr std::array<double, 2> kPlaces[] = {{-0.3, -0.2}, {-0.3, 0},   {-0.3, 0.3}, {0.2, -0.2},
                                               {0.2, 0},     {0.2, 0.3},  {0.1, -0.3}, {0.1, 0},
                                               {-0.4, 0},    {-0.4, 0.15}};
  for (const auto& [x_mm, z_mm] : kPlaces) {
    CuttingHand miller(scene, {x_mm, extremes::kSinkFromMm, z_mm});
    const SunkForce felt = sink(miller, x_mm, z_mm);
    MESSAGE("at ", x_mm, ", ", z_mm, " mm: largest step ", 100 * felt.step_ratio, " % of ",
            felt.mean_n, " N");
    CHECK(felt.step_ratio < 0.02);
  }
}

TEST_CASE("a thin wall gives way to cutting alone, and without a blow") {
  const Shape wall = [](double, double y, double) { return std::abs(y) - kVoxelMm; };
  for (const bool turns : {false, true}) {
    LoadedScene scene = mill_scene(wall);
    scene.spindle.speed_krpm = turns ? 300 : 0;
    scene.cut.machinability_mm3_per_s_n = 2;
    scene.force.damping_ns_per_mm = 0;
    CuttingHand miller(scene);
    std::array<double, 3> last_n{};
    double worst_n = 0;
    ServoOutput out;
    for (int ms = 0; ms < 1500; ++ms) {
      out = miller.step({0, std::max(-1.5, 1.2 - 0.01 * ms), 0});
      const std::array<double, 3> step_n{out.commanded_force_n[0] - last_n[0],
                                         out.commanded_force_n[1] - last_n[1],
                                         out.commanded_force_n[2] - last_n[2]};
      worst_n = std::max(worst_n, length(step_n));
      last_n = out.commanded_force_n;
    }
    const double tool_mm = out.position_mm[1] + out.proxy_offset_mm[1];
    CHECK((tool_mm < -1) == turns);  // through, or still on the upper face
    CHECK((length(out.commanded_force_n) < 0.2) == turns);
    CHECK(worst_n <= scene.limits.slew_n_per_ms + 1e-3);
  }
}

TEST_CASE("a tool that leaves its groove is not held back") {
  LoadedScene scene = mill_scene();
  scene.cut.machinability_mm3_per_s_n = 1;
  CuttingHand miller(scene);
  miller.hold({0, 0.2, 0}, 0.5);
  for (int ms = 0; ms < 150; ++ms) {
    const ServoOutput out = miller.step({0, 0.2 + 0.02 * ms, 0});
    CHECK(out.contact_force_n[1] >= 0);
    CHECK(out.commanded_force_n[1] > -0.01);
    if (ms > 60) CHECK(length(out.commanded_force_n) < 0.01);
  }
}

TEST_CASE("a tool that turns with the stylus cuts by the same law") {
  LoadedScene scene = mill_scene();
  scene.tools = {
      make_tool("shaft", "cylinder", {.pitch_mm = kVoxelMm, .radius_mm = 0.5, .length_mm = 3.0})};
  scene.cut.machinability_mm3_per_s_n = 0.5;
  CuttingHand miller(scene, {0, 4, 0});
  for (int ms = 0; ms < 1000; ++ms) miller.step({0, 3 - 0.004 * ms, 0});
  CHECK(miller.removed_mm3() > 0.05);
  // Its samples end inside of the rim that it rests on. What they miss waits, and it reaches deeper
  // before any of that is lost.
  CHECK(std::abs(miller.removed_mm3() / miller.fed_mm3() - 1) < 1e-5);
}

TEST_CASE("a ball of one sample at each pole loses nothing of what it should cut") {
  LoadedScene scene = mill_scene(flat, 64);
  scene.tools = {make_tool("ball", "ball", {.pitch_mm = kVoxelMm, .radius_mm = 1.0})};
  scene.cut.machinability_mm3_per_s_n = 2;  // 24 times that of enamel
  CuttingHand miller(scene);
  for (int ms = 0; ms < 1500; ++ms) {
    miller.step({1.5 * std::sin(0.005 * ms), 0.8 - 0.0008 * ms, 0});
  }
  CHECK(miller.removed_mm3() > 0.5);
  CHECK(std::abs(miller.removed_mm3() / miller.fed_mm3() - 1) < 1e-5);
}

TEST_CASE("the same reports cut the same bits, and no tick of cutting touches the heap") {
  const auto run = [](double force) {
    LoadedScene scene = mill_scene();
    CuttingHand miller(scene);
    const std::uint64_t before = CountedAllocations::total();
    ServoOutput out;
    {
      const CountedAllocations counted;
      for (int ms = 0; ms < 500; ++ms) out = miller.step({0.001 * ms, 0.8 - force, 0});
    }
    CHECK(CountedAllocations::total() == before);
    return out.output_hash;
  };
  CHECK(run(1) == run(1));
  CHECK(run(1) != run(1.5));
}

// The surface goes down voxel by voxel and lags within each, so the law is looked at where it has
// the same place in eight of them; and a bore of a few voxels is wider than its tool, so its area
// is what left it over the depth that is felt.
TEST_CASE(
    "S16: a hand held still in a wall that is cut feels F = K x0 exp(-t/tau), tau = A/(G K)") {
  constexpr double kRadiusMm = 0.5, kStiffness = 0.5, kMm3PerSN = 0.0826;
  constexpr int kVoxels = 8;
  for (const auto numeric : kinds({NumericKind::fixed, NumericKind::float64})) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = mill_scene();
    scene.servo.numeric = numeric;
    scene.tools = {make_tool("flat", "cylinder",
                             {.pitch_mm = kVoxelMm, .radius_mm = kRadiusMm, .length_mm = 2.0})};
    scene.tools[0].turns = false;
    scene.force.stiffness_n_per_mm = kStiffness;
    scene.force.damping_ns_per_mm = 0;
    scene.cut.machinability_mm3_per_s_n = kMm3PerSN;
    scene.cut.threshold_n = 0;
    scene.cut.friction = 0;
    scene.spindle.stall_torque_n_mm = 1000;  // it never slows down
    scene.limits.continuous_force_n = scene.limits.force_n;
    CuttingHand miller(scene, {0, 1.3, 0});
    const double start_n = length(miller.hold({0, -1, 0}, 0.05).commanded_force_n);  // of x0 = 2 mm
    const auto force_after = [&](int voxels) { return start_n - voxels * kStiffness * kVoxelMm; };
    struct Moment {
      double s = 0, removed_mm3 = 0;
    };
    Moment first, last;
    for (int ms = 1; ms < 30'000 && last.s == 0; ++ms) {
      const double force_n = length(miller.step({0, -1, 0}).commanded_force_n);
      const Moment now{0.001 * ms, miller.removed_mm3()};
      if (first.s == 0 && force_n <= force_after(1)) first = now;
      if (force_n <= force_after(1 + kVoxels)) last = now;
    }
    REQUIRE(last.s > first.s);
    const double area_mm2 = (last.removed_mm3 - first.removed_mm3) / (kVoxels * kVoxelMm);
    CAPTURE(area_mm2);
    CHECK(area_mm2 > std::numbers::pi * kRadiusMm * kRadiusMm);
    CHECK(area_mm2 < std::numbers::pi * std::pow(kRadiusMm + kVoxelMm, 2));
    const double tau_s = (last.s - first.s) / std::log(force_after(1) / force_after(1 + kVoxels));
    CAPTURE(tau_s);
    CHECK(std::abs(tau_s / (area_mm2 / (kMm3PerSN * kStiffness)) - 1) <= 0.01);
  }
}

}  // namespace kerf::force_cut_test
