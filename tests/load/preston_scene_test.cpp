// SPDX-License-Identifier: Apache-2.0
// Cutting by force as a scene says it: keys, tables in the loop's numbers, refusals.
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/scene_json.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/method/tool_bounds.hpp"
#include "controller/plan/plan_tools.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/scene/support.hpp"

namespace kerf::preston_scene_test {

using namespace kerf::test;

namespace {

// Five lines, so that what is appended begins on line 6.
const std::string kSmallest =
    "[[volume]]\n"
    "file = \"phantom\"\n"
    "[[tool]]\n"
    "shape = \"ball\"\n"
    "size_vox = 16\n";
const std::string kOverlap = "[cut]\nmodel = \"overlap\"\n";

SceneSpec parse(const std::string& lines) {
  return parse_scene(kSmallest + lines, "x.toml");
}

std::string error_after(const std::string& lines) {
  return test::error_of([&] { static_cast<void>(parse(lines)); });
}

/// A block of 0.1 x 0.2 x 0.25 mm voxels, its low half enamel, the rest dentin.
LoadedScene block_scene() {
  LoadedScene scene;
  scene.path = "block.toml";
  scene.materials = default_materials();
  SceneVolume volume;
  volume.image.grid = {20, 20, 20};
  volume.image.spacing_mm = {0.1, 0.2, 0.25};
  volume.image.density.assign(8000, 65535);
  volume.image.labels.assign(8000, 1);
  std::fill(volume.image.labels.begin() + 4000, volume.image.labels.end(), Label{2});
  scene.volumes.push_back(volume);
  scene.tools.push_back(make_tool("bur", "ball", {.pitch_mm = 0.1, .radius_mm = 0.5}));
  return scene;
}

/// Steps that one newton of force takes in one tick of a scene, all on one material.
double steps_per_n(const PrestonPlan<DoubleNumbers>& plan, std::size_t material) {
  return plan.rate[material].steps_per_n;
}

}  // namespace

TEST_CASE("the keys of cutting by force reach their places, and have defaults") {
  const SceneSpec plain = parse("");
  CHECK(plain.force.model == ForceModel::proxy);
  CHECK(plain.cut.model == CutModel::preston);
  CHECK(plain.cut.machinability_mm3_per_s_n == 0.083);
  CHECK(plain.cut.threshold_n == 0.05);
  CHECK(plain.cut.friction == 0.5);
  CHECK(plain.spindle.speed_krpm == 300);
  const SceneSpec scene = parse(
      "[cut]\nmachinability_mm3_per_s_n = 0.1\nthreshold_n = 0.2\n"
      "friction = 0.4\n[spindle]\nspeed_krpm = 150\n"
      "stall_torque_n_mm = 2\ninertia_g_mm2 = 3\n"
      "[[material]]\nname = \"pulp\"\nforbidden = true\n"
      "[[material]]\nname = \"amalgam\"\n"
      "[[material]]\nname = \"wax\"\nmachinability = 20\n");
  CHECK(scene.cut.machinability_mm3_per_s_n == 0.1);
  CHECK(scene.cut.threshold_n == 0.2);
  CHECK(scene.cut.friction == 0.4);
  CHECK(scene.spindle.speed_krpm == 150);
  CHECK(scene.spindle.stall_torque_n_mm == 2);
  CHECK(scene.spindle.inertia_g_mm2 == 3);
  REQUIRE(scene.materials.size() == 6);
  CHECK(scene.materials[3].forbidden);
  CHECK_FALSE(scene.materials[2].forbidden);
  CHECK(scene.materials[4].machinability == 2.5);  // known by its name
  CHECK(scene.materials[5].machinability == 20);
}

TEST_CASE("the paper's force comes with the paper's cut, unless another is written") {
  const std::string paper = "[force]\nmodel = \"paper\"\n";
  CHECK(parse(paper).force.model == ForceModel::paper);
  CHECK(parse(paper).cut.model == CutModel::overlap);
  CHECK(parse(paper + "[cut]\nmodel = \"none\"\n").cut.model == CutModel::none);
  CHECK(parse("[cut]\nmodel = \"preston\"\n" + paper).cut.model == CutModel::preston);
  CHECK(parse(kOverlap).force.model == ForceModel::proxy);
}

TEST_CASE("what cutting by force needs and its scene lacks is refused") {
  CHECK(error_after(kOverlap + "[spindle]\nspeed_krpm = 100\n")
            .starts_with("x.toml:9: spindle.speed_krpm = 100 turns nothing: "));
  CHECK(
      error_after(kOverlap + "[[material]]\nname = \"pulp\"\nforbidden = true\n")
          .starts_with("x.toml: material pulp is forbidden, and this cut.model cuts everything; "));
  LoadedScene scene = block_scene();
  scene.force.model = ForceModel::paper;
  CHECK(test::error_of([&] {
          static_cast<void>(plan_scene(scene));
        }).starts_with("block.toml: cut.model = \"preston\" needs the normal force of a proxy; "));
}

TEST_CASE("a bur has the law of its grit, and its own keys in place of the grit's") {
  const auto law_of = [](const std::string& keys) { return parse(keys).tools[0].law; };
  CHECK(law_of("") == BurLaw{});
  CHECK(law_of("grit = \"none\"\n") == BurLaw{});
  const BurLaw medium = law_of("grit = \"medium\"\n");
  CHECK(medium.force_exponent == 1);
  CHECK(medium.speed_exponent == 0);
  CHECK(medium.saturation_n == 0.98);
  CHECK(medium.wear_half_n_s == 110);
  const BurLaw coarse = law_of("grit = \"coarse\"\n");
  CHECK(coarse.saturation_n == 0);
  CHECK(coarse.wear_half_n_s > medium.wear_half_n_s);
  CHECK(law_of("grit = \"super-coarse\"\n").wear_half_n_s > coarse.wear_half_n_s);
  const BurLaw own = law_of(
      "grit = \"medium\"\nforce_exponent = 0.5\nspeed_exponent = 0.29\nsaturation_n = 2\n"
      "wear_half_n_s = 50\n");
  CHECK(own ==
        BurLaw{
            .force_exponent = 0.5, .speed_exponent = 0.29, .saturation_n = 2, .wear_half_n_s = 50});
}

TEST_CASE("a law that no bur has, or that has no effect, is refused in one line") {
  const auto complaint = [](const std::string& keys) {
    const std::string error = error_after(keys);
    CHECK(error.find('\n') == std::string::npos);
    return error;
  };
  for (const char* value : {"0", "3", "-1", "nan", "1e400"}) {
    CAPTURE(std::string(value));
    const std::string exponent = std::string("force_exponent = ") + value + "\n";
    CHECK(complaint(exponent).starts_with("x.toml:6:"));
    CHECK_FALSE(complaint("wear_half_n_s = " +
                          std::string(value == std::string("3") ? "0.5" : value) + "\n")
                    .empty());
  }
  CHECK(complaint("force_exponent = 3\n")
            .starts_with("x.toml:6: tool.force_exponent = 3 is out of range"));
  CHECK(complaint("force_exponent = 0\n").ends_with("use 0.1 to 2"));
  CHECK(complaint("speed_exponent = 3\n").ends_with("use 0 to 2"));
  CHECK(complaint("wear_half_n_s = 0\n").find("; use 1 to ") != std::string::npos);
  CHECK(complaint("saturation_n = 0\n").ends_with("use 0.1 to 100"));
  CHECK(complaint("grit = \"fine\"\n").starts_with("x.toml:6: tool.grit = \"fine\""));
  CHECK(complaint("saturation_n = 0.1\n[cut]\nthreshold_n = 0.2\n") ==
        "x.toml:6: tool.saturation_n = 0.1 leaves no force that cuts: cut.threshold_n is 0.2; use "
        "a lower threshold, or a saturation_n above it");
  CHECK(complaint("grit = \"medium\"\n" + kOverlap) ==
        "x.toml:6: tool.grit = \"medium\" is of cutting by force; set cut.model = \"preston\", or "
        "leave it out");
}

TEST_CASE("the temperature of the pulp is a mark that a scene asks for, with water of its own") {
  CHECK(parse("").cut.pulp == PulpMark::off);
  CHECK(parse("[cut]\npulp = \"dry\"\n").cut.pulp == PulpMark::dry);
  const SceneSpec wet = parse("[cut]\npulp = \"water\"\nwater_c = 35\n");
  CHECK(wet.cut.pulp == PulpMark::water);
  CHECK(wet.cut.water_c == 35);
  CHECK(error_after("[cut]\nwater_c = 35\n").starts_with("x.toml:7: cut.water_c = 35"));
  CHECK(error_after("[cut]\npulp = \"water\"\nwater_c = 61\n").ends_with("use 0 to 60"));
  CHECK(error_after("[cut]\npulp = \"wet\"\n").starts_with("x.toml:7: cut.pulp = \"wet\""));
  CHECK(error_after("[cut]\nmodel = \"overlap\"\npulp = \"dry\"\n")
            .starts_with("x.toml:8: cut.pulp = \"dry\""));
  LoadedScene scene = block_scene();
  const std::string before = canonical_json(scene);
  CHECK(before.find("water_c") == std::string::npos);
  scene.cut.pulp = PulpMark::dry;
  CHECK(canonical_json(scene) != before);
}

TEST_CASE("the scene's identity holds the law of a bur that has one, and is else as ever") {
  LoadedScene scene = block_scene();
  const std::string before = canonical_json(scene);
  CHECK(before.find("speed_exponent") == std::string::npos);
  scene.tools[0].law.wear_half_n_s = 50;
  CHECK(canonical_json(scene) != before);
}

TEST_CASE("the scene's identity holds what its model of cutting uses, and nothing else") {
  LoadedScene scene = block_scene();
  const std::string before = canonical_json(scene);
  scene.cut.rate_per_s = 99;
  CHECK(canonical_json(scene) == before);
  scene.spindle.inertia_g_mm2 = 9;
  CHECK(canonical_json(scene) != before);
  scene.cut.model = CutModel::overlap;
  const std::string text = canonical_json(scene);
  CHECK(text.find("spindle") == std::string::npos);
  CHECK(text.find("threshold_n") == std::string::npos);
  CHECK(text.find("forbidden") == std::string::npos);
}

TEST_CASE("the tables of a scene hold rates by material, per newton and tick") {
  LoadedScene scene = block_scene();
  scene.servo.rate_hz = 2000;
  scene.materials[3].forbidden = true;
  const auto plan = plan_preston<DoubleNumbers>(scene, scene.volumes[0]);
  const double enamel = 0.083 / 2000 / (0.1 * 0.2 * 0.25) * 65535;
  CHECK(steps_per_n(plan, 1) == doctest::Approx(enamel).epsilon(1e-12));
  CHECK(steps_per_n(plan, 0) == steps_per_n(plan, 1));
  CHECK(steps_per_n(plan, 2) == doctest::Approx(3 * enamel).epsilon(1e-12));
  CHECK(plan.forbidden[3]);
  CHECK(steps_per_n(plan, 3) == 0);
}

TEST_CASE("a scene's spindle and frame are those of its numbers") {
  const LoadedScene scene = block_scene();
  const auto spindle = plan_spindle<DoubleNumbers>(scene);
  CHECK(spindle.free_ratio == 1);
  CHECK(spindle.loads_per_n_mm == doctest::Approx(1.0 / 3));
  // J omega / tau = 4.5e-9 kg m^2 * 31416 / s / 3e-3 N m = 47 ms.
  CHECK(spindle.approach == doctest::Approx(1 - std::exp(-0.001 / 0.047124)).epsilon(1e-5));
  const auto rims = rims_from_voxel<DoubleNumbers>(scene.tools[0], scene.volumes[0]);
  CHECK(rims.row[0][0] == doctest::Approx(0.2));
  CHECK(rims.row[1][1] == doctest::Approx(0.4));
  CHECK(rims.row[2][2] == doctest::Approx(0.5));
}

TEST_CASE_TEMPLATE("the tables cut a block: each material at its rate, at the same mm^3 per second",
                   N, FixedNumbers, DoubleNumbers) {
  using Real = typename N::Real;
  LoadedScene scene = block_scene();
  const SceneTool& tool = scene.tools[0];
  SceneVolume& volume = scene.volumes[0];
  for (const int rate_hz : {500, 4000}) {
    scene.servo.rate_hz = rate_hz;
    volume.image.density.assign(8000, 65535);
    auto plan = plan_preston<N>(scene, volume);
    plan.labels = volume.image.labels;
    std::vector<CoveredVoxel<N>> memory(max_covered_voxels(tool, volume));
    const std::size_t capacity =
        overlap_capacity(volume.image.grid, tool.size_vox, tool.pitch_mm, volume.image.spacing_mm);
    std::vector<typename N::Weight> ratios(capacity);
    OverlapBox<N> box{ratios, {}, 0};
    ToolPose<N> pose;
    pose.centre_vox = {Real(10), Real(10), Real(15)};  // in dentin alone
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pose.step[axis][axis] = step_of<N>(0.1 / volume.image.spacing_mm[axis]);
    }
    Transform<typename N::Unit, WorldSpace, ToolSpace> upright;
    for (std::size_t axis = 0; axis < 3; ++axis) upright.row[axis][axis] = typename N::Unit(1);
    const SpindleFrame<N> frame{pose.centre_vox, rims_from_voxel<N>(tool, volume), upright};
    const auto drive = cut_drive<N>(plan_law<N>(scene, tool), Real(1.05), typename N::Unit(1));
    PrestonState<N> state;
    std::size_t largest = 0;
    for (int i = 0; i < rate_hz / 10; ++i) {
      const VoxelBox reached = overlap<N>(volume.image.grid, tool.offsets, pose,
                                          step_of<N>(0.001 / (0.1 * 0.2 * 0.25)), box);
      largest = std::max(
          largest,
          VoxelGrid{reached.extent().x, reached.extent().y, reached.extent().z}.voxel_count());
      const std::span<Density> density = volume.image.density;
      auto covered = covered_voxels<N>(volume.image.grid, std::span<const Density>(density),
                                       plan.labels, box, frame, std::span(memory));
      cut_by_force(plan, drive, density, state, covered);
    }
    CHECK(largest <= memory.size());
    double removed = 0;
    for (const Density rho : volume.image.density) removed += 65535 - rho;
    const double removed_mm3 = removed / 65535 * 0.1 * 0.2 * 0.25;
    CHECK(std::abs(removed_mm3 / (3 * 0.083 * 0.1) - 1) < 1e-3);
  }
}

}  // namespace kerf::preston_scene_test
