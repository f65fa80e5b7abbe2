// SPDX-License-Identifier: Apache-2.0
// The method `aligned` inside the servo step: the forces of double, whatever method each tool has.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/servo/support.hpp"

namespace kerf::aligned_scene_test {

using namespace kerf::test;

namespace {

Method method_of(const LoadedScene& scene, const SceneTool& tool, const SceneVolume& volume) {
  return choose_method({scene, tool, volume, kScalarSet}).method->step;
}

constexpr double kFullScaleN = 0.06 * std::numbers::pi;  // the peak of p0 pi R^2

double worst_difference_n(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double worst = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) worst = std::max(worst, std::abs(a[axis] - b[axis]));
  return worst;
}

/// The same scene in fixed point and in double, stepped by the same hand.
class Pair {
 public:
  explicit Pair(const std::function<LoadedScene()>& make) {
    LoadedScene first = make(), second = make();
    second.servo.numeric = NumericKind::float64;
    fixed_ = compile(first);
    exact_ = compile(second);
    arm_at(*fixed_, fixed_arm_, 0, 5, 0);
    arm_at(*exact_, exact_arm_, 0, 5, 0);
  }
  void step(double x, double y, double z) {
    fixed = fixed_->step(fixed_arm_.at(x, y, z));
    exact = exact_->step(exact_arm_.at(x, y, z));
  }
  void select(std::uint32_t tool) {
    fixed_->apply({ServoCommand::Kind::select_tool, tool});
    exact_->apply({ServoCommand::Kind::select_tool, tool});
  }
  ServoOutput fixed, exact;

 private:
  std::unique_ptr<AnyServo> fixed_, exact_;
  KinematicOmni fixed_arm_, exact_arm_;
};

LoadedScene cutting_scene() {
  LoadedScene scene = paper_scene();
  scene.cut.model = CutModel::overlap;
  return scene;
}

}  // namespace

TEST_CASE("both forces of the first cutting tick are double's within 1.7e-4 of full scale") {
  for (const auto kernel : {GradientKernel::farid, GradientKernel::sobel5}) {
    for (const double y : {0.9, 0.6, 0.2}) {
      Pair pair([&] {
        LoadedScene scene = cutting_scene();
        scene.servo.kernel = kernel;
        if (y < 0.5) scene.cut.model = CutModel::overlap_exact;
        return scene;
      });
      pair.step(0.11, y, -0.07);
      CAPTURE(y);
      CHECK(pair.exact.contact_force_n[1] > 0.01);
      CHECK(pair.exact.modification_n[1] > 0.005);
      CHECK(worst_difference_n(pair.fixed.contact_force_n, pair.exact.contact_force_n) <
            1.7e-4 * kFullScaleN);
      CHECK(worst_difference_n(pair.fixed.modification_n, pair.exact.modification_n) <
            1.7e-4 * kFullScaleN);
      CHECK(double(pair.fixed.removed_steps) ==
            doctest::Approx(double(pair.exact.removed_steps)).epsilon(1e-3));
      CHECK(pair.fixed.changed[0] == pair.exact.changed[0]);
    }
  }
}

TEST_CASE("tools of both methods feel what the other has cut") {
  Pair pair([] {
    LoadedScene scene = cutting_scene();
    scene.tools.push_back(ball(20, kVoxelMm / 2));  // finer than the volume: stored gradients
    return scene;
  });
  double deepest_n = 0;
  for (int i = 0; i < 400; ++i) {
    if (i % 50 == 0) pair.select(static_cast<std::uint32_t>(i / 50 % 2));
    pair.step(0.6 * std::sin(i * 0.05), 0.55, 0.3 * std::cos(i * 0.05));
    deepest_n = std::max(deepest_n, std::abs(pair.exact.contact_force_n[1]));
    // Removal rounds to whole steps, and its carry moves fractions between voxels.
    REQUIRE(worst_difference_n(pair.fixed.contact_force_n, pair.exact.contact_force_n) <
            4e-4 * kFullScaleN);
  }
  CHECK(deepest_n > 0.1 * kFullScaleN);
}

TEST_CASE("two volumes of different spacing each get their own method") {
  Pair pair([] {
    LoadedScene scene = cutting_scene();
    scene.volumes.push_back(
        volume_of(40, 0.2, [](double x, double y, double) { return std::max(y, x); }));
    return scene;
  });
  for (int i = 0; i < 50; ++i) {
    pair.step(0.2, 0.6, 0.01 * i);
    REQUIRE(worst_difference_n(pair.fixed.contact_force_n, pair.exact.contact_force_n) <
            4e-4 * kFullScaleN);
    REQUIRE(worst_difference_n(pair.fixed.modification_n, pair.exact.modification_n) <
            4e-4 * kFullScaleN);
  }
  CHECK(pair.exact.contact_force_n[1] > 0.01);
}

TEST_CASE("a tool that does not turn runs aligned in a standing volume, and ignores the stylus") {
  constexpr std::array<double, 4> kStanding{-std::numbers::sqrt2 / 2, 0, 0,
                                            std::numbers::sqrt2 / 2};
  const auto scene_of = [&](bool turns) {
    LoadedScene scene = cutting_scene();
    scene.volumes[0].pose.orientation = kStanding;
    const double end = -scene.volumes[0].pose.position_mm[0];
    scene.volumes[0].pose.position_mm = {-end, -end, end};  // its middle stays the origin
    scene.tools[0] = make_tool("bur", "cone", {.pitch_mm = kVoxelMm, .radius_mm = 0.6});
    scene.tools[0].turns = turns;
    return scene;
  };
  const LoadedScene unturned = scene_of(false), turning = scene_of(true);
  const SceneVolume& volume = unturned.volumes[0];
  REQUIRE(method_of(unturned, unturned.tools[0], volume) == Method::aligned);
  REQUIRE(method_of(turning, turning.tools[0], volume) == Method::splat);

  for (const bool turns : {false, true}) {  // by the method `aligned`, by the method `splat`
    Pair pair([&] { return scene_of(turns); });
    double deepest_n = 0;
    for (int i = 0; i < 40; ++i) {
      pair.step(0.3, 0.2, 0.5 - 0.02 * i);
      deepest_n = std::max(deepest_n, std::abs(pair.exact.contact_force_n[2]));
      REQUIRE(worst_difference_n(pair.fixed.contact_force_n, pair.exact.contact_force_n) <
              4e-4 * kFullScaleN);
      REQUIRE(worst_difference_n(pair.fixed.modification_n, pair.exact.modification_n) <
              4e-4 * kFullScaleN);
    }
    CHECK(deepest_n > 0.01);
    const std::array<double, 9> world{1, 0, 0, 0, 1, 0, 0, 0, 1};
    CHECK((pair.fixed.rotation == world) == !turns);
  }
}

TEST_CASE("a tool that no sum of fixed-point numbers can hold is refused with a way out") {
  const auto refusal = [](const LoadedScene& scene) -> std::string {
    try {
      static_cast<void>(method_of(scene, scene.tools[0], scene.volumes[0]));
    } catch (const LoadError& error) {
      return error.what();
    }
    return {};
  };
  LoadedScene scene = cutting_scene();
  scene.path = "x.toml";
  scene.volumes[0].name = "tooth";
  scene.tools[0] = make_tool("pin", "cylinder", {.pitch_mm = kVoxelMm / 6, .radius_mm = 0.1});
  CHECK(refusal(scene).empty());
  scene.tools[0].pitch_mm = kVoxelMm / 7;
  CHECK(refusal(scene) ==
        "x.toml: tool pin in volume tooth: up to 665 samples in one voxel, and 512 are the end; "
        "give the tool a larger pitch_mm, or set servo.numeric = \"double\"");
  scene.tools[0].pitch_mm = kVoxelMm;
  scene.tools[0].size_vox = {200, 200, 200};
  CHECK(refusal(scene).find(" voxels of a plane under the tool, and 36000 are the end") !=
        std::string::npos);
  scene.cut.model = CutModel::none;
  CHECK(refusal(scene).empty());
  scene.tools[0].offsets.push_back({0, -2 * 1100, 0});  // no wider than 2000, all on one side
  CHECK(refusal(scene).find("up to 1100 voxels from the tool's centre, and 1000 are the end") !=
        std::string::npos);
  scene.servo.numeric = NumericKind::float64;
  CHECK(refusal(scene).empty());
}

TEST_CASE("an unturned tool needs the volume's axes to be the world's") {
  LoadedScene scene = cutting_scene();
  scene.tools.push_back(make_tool("cube", "cylinder", {.pitch_mm = kVoxelMm, .radius_mm = 1}));
  scene.tools[1].turns = false;
  scene.volumes[0].pose.orientation = {0, 0, std::sin(0.1), std::cos(0.1)};
  const SceneVolume& volume = scene.volumes[0];
  CHECK(method_of(scene, scene.tools[0], volume) == Method::aligned);  // round
  CHECK(method_of(scene, scene.tools[1], volume) == Method::splat);
  scene.cut.model = CutModel::none;
  CHECK(method_of(scene, scene.tools[1], volume) == Method::gather);
}

}  // namespace kerf::aligned_scene_test
