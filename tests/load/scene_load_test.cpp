// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/plan_tools.hpp"
#include "tests/rig/tool_meshes.hpp"
#include "tests/scene/support.hpp"
#include "tests/support/property.hpp"
#include "tests/support/real_data.hpp"
#include "tests/tool/stl_support.hpp"

namespace kerf::scene_load_test {

using namespace kerf::test;

namespace {

// A flat block of 20 x 20 x 10 voxels in air.
constexpr VoxelGrid kGrid{30, 30, 24};
constexpr VoxelBox kBlock{{5, 5, 7}, {25, 25, 17}};

/// A scene with one block of the given voxel edge, and the lines that follow.
std::filesystem::path block_scene(const TemporaryFolder& folder, double edge_mm,
                                  const std::string& lines) {
  static_cast<void>(folder.write(
      "block.nrrd", nrrd(kGrid, {edge_mm, edge_mm, edge_mm}, block(kGrid, kBlock, 1000))));
  return folder.write("scene.toml", "[[volume]]\nfile = \"block.nrrd\"\n" + lines);
}

const std::string kBall = "[[tool]]\nshape = \"ball\"\nsize_vox = 8\n";

std::string load_error(const std::filesystem::path& scene, const SceneOverrides& overrides = {}) {
  return test::error_of([&] { static_cast<void>(load_scene(scene, overrides)); });
}

/// Of its materials.
std::string names(const LoadedScene& scene) {
  std::string text;
  for (const Material& material : scene.materials) text += material.name + " ";
  return text;
}

}  // namespace

TEST_CASE("all scenes of the project load") {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(KERF_SCENES_DIR)) {
    if (entry.path().extension() != ".toml") continue;
    if (entry.path().stem() == "skull") continue;  // its CT does not come with kerf
    CAPTURE(entry.path());
    ++count;
    const LoadedScene scene = load_scene(entry.path(), {.phantom_size = VoxelGrid{64, 64, 40}});
    CHECK_FALSE(scene.device.torque_scale);  // whose motors they move, they cannot know
    CHECK(std::filesystem::exists(scene.hand_script));
    const std::string& shape = scene.volume_specs.front().shape;
    if (shape == kMolar || shape == kCariousMolar) {
      CHECK(scene.device.offset_mm[1] > 2);  // the crown's top, well above the middle of the tooth
    }
  }
  CHECK(count >= 10);
}

TEST_CASE("the default scene is what the hand scripts were written for") {
  const LoadedScene scene = load_scene(std::filesystem::path(KERF_SCENES_DIR) / "phantom.toml");
  CHECK(scene.volumes.at(0).image.spacing_mm == std::array<double, 3>{0.125, 0.125, 0.125});
  CHECK(scene.tools.at(0).radius_mm == 1.0);
  CHECK(scene.tools.at(0).offsets.size() == 2176);
  CHECK(scene.tools.at(1).offsets.size() == 552);
  CHECK(hand_unit_mm(scene) == 1.0);
  CHECK(device_stiffness_n_per_mm(scene) == 0.4);
  CHECK(scene.volumes.at(0).image.labels.size() == scene.volumes.at(0).image.density.size());
}

TEST_CASE("a volume is windowed, thresholded, cropped and stood up around the origin") {
  const TemporaryFolder folder;
  const LoadedScene scene = load_scene(block_scene(folder, 0.5, kBall));
  const SceneVolume& volume = scene.volumes.at(0);
  CHECK(volume.name == "block");
  CHECK(volume.image.grid == VoxelGrid{26, 26, 16});  // the block and three voxels around
  CHECK(*std::max_element(volume.image.density.begin(), volume.image.density.end()) == 65535);
  CHECK(volume.iso > 0);  // between air and block, where Otsu puts it
  const WorldBox box = world_box(volume);
  CHECK(box.hi_mm[0] == doctest::Approx(6.5));
  CHECK(box.hi_mm[1] == doctest::Approx(4.0));  // z of the file is up
  CHECK(box.lo_mm[1] == doctest::Approx(-4.0));
  CHECK(box.hi_mm[2] == doctest::Approx(6.5));
  CHECK(scene.tools.at(0).pitch_mm == 0.5);  // the voxel edge
}

TEST_CASE("the device origin is put on the first surface unless the scene says where") {
  const TemporaryFolder folder;
  const LoadedScene found = load_scene(
      block_scene(folder, 0.5, "iso = 0.5\npose = { position_mm = [7, 8, 9] }\n" + kBall));
  // Half density lies half-way between the block's last voxel and air: 10 voxels are 5 mm.
  CHECK(found.device.offset_mm[0] == doctest::Approx(7));
  CHECK(found.device.offset_mm[1] == doctest::Approx(8 + 2.5).epsilon(0.001));
  CHECK(found.device.offset_mm[2] == doctest::Approx(9));
  const LoadedScene given =
      load_scene(block_scene(folder, 0.5, kBall + "[device]\noffset_mm = [1, 2, 3]\n"));
  CHECK(given.device.offset_mm == std::array<double, 3>{1, 2, 3});
}

TEST_CASE("the first solid volume is touched, not what is only seen") {
  const TemporaryFolder folder;
  const LoadedScene scene =
      load_scene(block_scene(folder, 0.5,
                             "solid = false\n[[volume]]\nname = \"felt\"\nfile = "
                             "\"block.nrrd\"\noverride_spacing_mm = 0.25\n"
                             "pose = { position_mm = [20, 0, 0] }\n" +
                                 kBall));
  CHECK(scene.device.offset_mm[0] == doctest::Approx(20));
  CHECK(scene.tools.at(0).pitch_mm == 0.25);
}

TEST_CASE("a volume from the command line is fitted to the hand") {
  const TemporaryFolder folder;
  const std::string lines =
      "[[volume]]\nfile = \"phantom\"\n[[tool]]\nshape = \"ball\"\nsize_vox = 8\n[[tool]]\n"
      "shape = \"cylinder\"\nradius_mm = 0.5\nlength_mm = 1\n[device]\noffset_mm = [9, 9, 9]\n";
  for (const double edge_mm : {0.05, 0.5, 3.0}) {
    CAPTURE(edge_mm);
    static_cast<void>(block_scene(folder, edge_mm, kBall));
    const auto base = folder.write("base.toml", lines + "[force]\nmodel = \"paper\"\n");
    SceneOverrides overrides;
    overrides.volume_file = base.parent_path() / "block.nrrd";
    const LoadedScene scene = load_scene(base, overrides);

    const WorldBox box = world_box(scene.volumes.at(0));
    const double scale = scene.device.workspace_scale;
    double fill = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double device_mm = (box.hi_mm[axis] - box.lo_mm[axis]) / scale;
      CHECK(device_mm <= kWorkspaceMm[axis] * (1 + 1e-12));
      fill = std::max(fill, device_mm / kWorkspaceMm[axis]);
    }
    CHECK(fill == doctest::Approx(1));  // as large as fits
    CHECK(scene.device.offset_mm[1] == doctest::Approx(5 * edge_mm).epsilon(0.2));

    // Sizes in voxels stay, sizes in mm were written for the phantom's 0.125 mm.
    CHECK(scene.tools.at(0).size_vox == std::array<std::int32_t, 3>{8, 8, 8});
    CHECK(scene.tools.at(0).radius_mm == doctest::Approx(4 * edge_mm));
    CHECK(scene.tools.at(1).radius_mm == doctest::Approx(4 * edge_mm));
    CHECK(scene.tools.at(1).length_mm == doctest::Approx(8 * edge_mm));

    // The hand feels the default scene's stiffness, and its script grows with the tool.
    CHECK(device_stiffness_n_per_mm(scene) == doctest::Approx(2 * std::numbers::pi * 0.06));
    CHECK(scene.cut.p1_n_per_mm2 == doctest::Approx(scene.force.p0_n_per_mm2));
    CHECK(hand_unit_mm(scene) == doctest::Approx(4 * edge_mm / scale));
  }
}

TEST_CASE("a scene that says fit is fitted to its own volume as one of the command line is") {
  const TemporaryFolder folder;
  const std::string rest = kBall + "[force]\nmodel = \"paper\"\n";
  const auto base = folder.write("base.toml", "[[volume]]\nfile = \"phantom\"\n" + rest);
  static_cast<void>(block_scene(folder, 0.5, kBall));
  SceneOverrides overrides;
  overrides.volume_file = base.parent_path() / "block.nrrd";
  const LoadedScene given = load_scene(base, overrides);
  const LoadedScene fitted =
      load_scene(folder.write("fit.toml", "[[volume]]\nfile = \"block.nrrd\"\n" + rest +
                                              "[device]\nfit = true\nworkspace_scale = 7\n"));
  CHECK(fitted.device.workspace_scale == doctest::Approx(given.device.workspace_scale));
  CHECK(fitted.cut.machinability_mm3_per_s_n ==
        doctest::Approx(given.cut.machinability_mm3_per_s_n));
  CHECK(fitted.force.p0_n_per_mm2 == doctest::Approx(given.force.p0_n_per_mm2));
  CHECK(fitted.tools.at(0).radius_mm == given.tools.at(0).radius_mm);
}

TEST_CASE("where no voxel has a label there is no enamel and no pulp") {
  const TemporaryFolder folder;
  CHECK(names(load_scene(block_scene(folder, 0.5, kBall))) == "none ");
  CHECK(names(load_scene(block_scene(
            folder, 0.5,
            kBall + "[[material]]\nname = \"bone\"\n[[material]]\nname = \"pulp\"\n"))) ==
        "none pulp bone ");
  SceneOverrides overrides;
  overrides.volume_file = folder.write("x", "").parent_path() / "block.nrrd";
  const LoadedScene ct =
      load_scene(std::filesystem::path(KERF_SCENES_DIR) / "phantom.toml", overrides);
  CHECK(names(ct).find("pulp") == std::string::npos);
  CHECK(names(ct).find("enamel") == std::string::npos);
  CHECK(ct.materials.size() >= 2);
  CHECK_FALSE(ct.volumes.at(0).proposal.empty());
  CHECK(names(load_scene(std::filesystem::path(KERF_SCENES_DIR) / "phantom.toml")) ==
        "none enamel dentin pulp ");
}

TEST_CASE("a map of labels of the command line becomes a material each") {
  const TemporaryFolder folder;
  auto values = block(kGrid, kBlock, 2);
  for (std::size_t i = 0; i < values.size() / 2; ++i) values[i] = values[i] == 2 ? 5 : 0;
  SceneOverrides overrides;
  overrides.volume_file = folder.write("map.nrrd", nrrd(kGrid, {0.5, 0.5, 0.5}, values));
  const auto phantom = std::filesystem::path(KERF_SCENES_DIR) / "phantom.toml";
  const LoadedScene scene = load_scene(phantom, overrides);
  const SceneVolume& volume = scene.volumes.at(0);
  CHECK(names(scene) == "none enamel dentin pulp label 4 label 5 ");
  CHECK(scene.materials.at(4).colour != scene.materials.at(5).colour);
  CHECK(scene.materials.at(5).iso == doctest::Approx(volume.iso / kDensityMax));
  CHECK(std::ranges::count(volume.image.labels, Label{5}) == 20 * 20 * 5);
  CHECK(std::ranges::count(volume.image.labels, Label{2}) == 20 * 20 * 5);
  CHECK(std::ranges::count(volume.image.density, Density{65535}) == 20 * 20 * 10);
  CHECK(volume.proposal.at(0) == "materials=by label, a map of labels alone; the highest is 5");
  for (auto& value : values) value = value == 5 ? 32 : value;
  overrides.volume_file = folder.write("high.nrrd", nrrd(kGrid, {0.5, 0.5, 0.5}, values));
  CHECK(load_error(phantom, overrides) ==
        "--volume: label 32 is above 31, the last that a scene has a material for; number the "
        "labels anew, or take them as a scan with --window 0,32");
  overrides.window = {{0, 32}};
  CHECK(load_scene(phantom, overrides).volumes.at(0).image.labels.empty());
}

TEST_CASE("a window of the command line goes before the proposal's") {
  const TemporaryFolder folder;
  static_cast<void>(block_scene(folder, 0.5, kBall));
  SceneOverrides overrides;
  overrides.volume_file = folder.write("x", "").parent_path() / "block.nrrd";
  overrides.window = {{-1000, 3000}};
  const LoadedScene scene =
      load_scene(std::filesystem::path(KERF_SCENES_DIR) / "phantom.toml", overrides);
  CHECK(scene.volumes.at(0).proposal.at(1).find("window=-1000 .. 3000") == 0);
}

TEST_CASE("a shaft grows with its tool in a volume of the command line") {
  const TemporaryFolder folder;
  static_cast<void>(block_scene(folder, 0.5, kBall));
  const auto base =
      folder.write("base.toml",
                   "[[volume]]\nfile = \"phantom\"\n[[tool]]\nshape = \"ball\"\nradius_mm = 0.5\n"
                   "shaft_radius_mm = 0.25\nshaft_length_mm = 3\nhandpiece_radius_mm = 1\n");
  SceneOverrides overrides;
  overrides.volume_file = base.parent_path() / "block.nrrd";
  const SceneTool tool = load_scene(base, overrides).tools.at(0);
  CHECK(tool.radius_mm == doctest::Approx(2));  // written for 0.125 mm
  CHECK(tool.shaft.radius_mm == doctest::Approx(1));
  CHECK(tool.shaft.end_mm == doctest::Approx(12 - 2));
  CHECK(tool.shaft.handpiece_radius_mm == doctest::Approx(4));
  CHECK(tool.shaft.handpiece_end_mm == doctest::Approx(14));
}

TEST_CASE("a press cuts the same share of the tool's volume in a volume of the command line") {
  const TemporaryFolder folder;
  constexpr double kEdgeMm = 0.5, kGrown = 4;  // over the phantom's voxels
  static_cast<void>(block_scene(folder, kEdgeMm, kBall));
  const auto base = folder.write("base.toml", "[[volume]]\nfile = \"phantom\"\n" + kBall);
  SceneOverrides overrides;
  overrides.volume_file = base.parent_path() / "block.nrrd";
  const LoadedScene fitted = load_scene(base, overrides);
  const LoadedScene plain;
  const double scale = fitted.device.workspace_scale;

  // Of a hand's newton, over the threshold: tool volumes per second.
  const auto share = [](const LoadedScene& scene, double device_n) {
    const double force_n = device_n / scene.device.workspace_scale - scene.cut.threshold_n;
    return scene.cut.machinability_mm3_per_s_n * force_n;
  };
  CHECK(share(fitted, 0.3) / (kGrown * kGrown * kGrown) == doctest::Approx(share(plain, 0.3)));
  // Torque goes with force and radius, and the run-up with inertia over torque.
  CHECK(fitted.spindle.stall_torque_n_mm * scale / kGrown ==
        doctest::Approx(plain.spindle.stall_torque_n_mm));
  CHECK(fitted.spindle.inertia_g_mm2 / fitted.spindle.stall_torque_n_mm ==
        doctest::Approx(plain.spindle.inertia_g_mm2 / plain.spindle.stall_torque_n_mm));
  CHECK(device_stiffness_n_per_mm(fitted) == device_stiffness_n_per_mm(plain));
}

TEST_CASE(
    "a bur cuts by its law of the hand's newtons, and wears alike, in a volume of the command "
    "line") {
  const TemporaryFolder folder;
  constexpr double kEdgeMm = 0.5, kGrown = 4;  // over the phantom's voxels
  static_cast<void>(block_scene(folder, kEdgeMm, kBall));
  const auto base = folder.write("base.toml", "[[volume]]\nfile = \"phantom\"\n" + kBall +
                                                  "force_exponent = 1.5\nsaturation_n = 0.6\n"
                                                  "wear_half_n_s = 50\n");
  SceneOverrides overrides;
  overrides.volume_file = base.parent_path() / "block.nrrd";
  const LoadedScene fitted = load_scene(base, overrides);
  LoadedScene plain;
  plain.tools.emplace_back().law = {
      .force_exponent = 1.5, .saturation_n = 0.6, .wear_half_n_s = 50};
  const auto share = [](const LoadedScene& scene, double device_n) {
    const auto law = plan_law<DoubleNumbers>(scene, scene.tools.at(0));
    return scene.cut.machinability_mm3_per_s_n *
           cut_drive<DoubleNumbers>(law, device_n / scene.device.workspace_scale, 1);
  };
  for (const double device_n : {0.1, 0.3, 0.9}) {
    CHECK(share(fitted, device_n) / (kGrown * kGrown * kGrown) ==
          doctest::Approx(share(plain, device_n)));
  }
  CHECK(fitted.tools.at(0).law.wear_half_n_s * fitted.device.workspace_scale ==
        doctest::Approx(50));
}

TEST_CASE("power is kept between hand and scene: F dx is the same on both sides") {
  // K_device = s^2 K_scene: twice the scale, a quarter of p0, the same stiffness at the hand.
  LoadedScene scene;
  scene.force.model = ForceModel::paper;
  scene.tools.emplace_back();
  const double at_one = device_stiffness_n_per_mm(scene);
  scene.device.workspace_scale = 2;
  scene.force.p0_n_per_mm2 /= 4;
  CHECK(device_stiffness_n_per_mm(scene) == doctest::Approx(at_one));
  CHECK(hand_unit_mm(scene) == 0.5);
}

TEST_CASE("options of the command line change the scene") {
  const TemporaryFolder folder;
  const auto path =
      block_scene(folder, 0.5, kBall + "[cut]\nmodel = \"overlap\"\nrate_per_s = \"1/T\"\n");
  SceneOverrides overrides;
  overrides.rate_hz = 4000;
  overrides.numeric = NumericKind::float64;
  overrides.override_spacing_mm = {0.2, 0.3, 0.4};
  overrides.window = {0, 2000};
  const LoadedScene scene = load_scene(path, overrides);
  CHECK(scene.servo.rate_hz == 4000);
  CHECK(scene.cut.rate_per_s == 4000);  // the paper's step follows the rate
  CHECK(scene.servo.numeric == NumericKind::float64);
  CHECK(scene.volumes.at(0).image.spacing_mm == std::array<double, 3>{0.2, 0.3, 0.4});
  const auto& density = scene.volumes.at(0).image.density;
  CHECK(*std::max_element(density.begin(), density.end()) == 32768);  // 1000 of 2000
  CHECK(has(scene.volumes.at(0).note, "OVERRIDDEN: spacing 0.2 x 0.3 x 0.4 mm"));
  CHECK(load_scene(path).cut.rate_per_s == 1000);
}

TEST_CASE("bad options and volumes that cannot be used are refused in one line with their place") {
  const TemporaryFolder folder;
  const auto path = block_scene(folder, 0.5, kBall);
  const auto phantom = folder.write("p.toml", "[[volume]]\nfile = \"phantom\"\n" + kBall);
  SceneOverrides missing;
  missing.volume_file = "/nowhere/ct.nrrd";
  CHECK(has(load_error(path, {.rate_hz = 10}), "--rate 10 is out of range; use 250 to 8000"));
  CHECK(has(load_error(path, {.window = std::array{3.0, 3.0}}), "--window is empty"));
  CHECK(has(load_error(path, {.spacing_mm = std::array{0.0, 1.0, 1.0}}), "--spacing"));
  CHECK(has(load_error(path, {.override_spacing_mm = std::array{0.0, 1.0, 1.0}}),
            "--override-spacing"));
  CHECK(has(load_error(path, {.spacing_mm = std::array{0.5, 0.5, 0.25}}),
            "spacing 0.25 mm along z is given, and the file has 0.5"));
  CHECK(has(load_error(phantom, {.spacing_mm = std::array{1.0, 1.0, 1.0}}),
            "--spacing: the phantom"));
  CHECK(load_error(phantom, missing).starts_with("--volume: "));
  std::filesystem::copy(std::filesystem::path(KERF_SCENES_DIR) / "skull.toml", folder.path());
  CHECK(has(load_error(folder / "skull.toml"),
            "skull/ct.nrrd: no such file or folder; check the path, or get"));
  static_cast<void>(folder.write("cut.nrrd", nrrd(kGrid, {1, 1, 1}, std::vector<Density>(10))));
  for (const auto& [scene, why] :
       {std::pair{folder.write("m.toml", "\n[[volume]]\nfile = \"gone.nrrd\"\n" + kBall),
                  "m.toml:3: "},
        {folder.write("t.toml", "[[volume]]\nfile = \"cut.nrrd\"\n" + kBall), "t.toml:2: "},
        {block_scene(folder, 0.5, "window = [5000, 6000]\niso = 0.5\n" + kBall),
         "scene.toml:2: "}}) {
    CHECK(has(load_error(scene), why));
    CHECK_FALSE(has(load_error(scene), "\n"));
  }
  CHECK(has(load_error(block_scene(folder, 0.5, "pose = { position_mm = [9999, 0, 0] }\n" + kBall)),
            "mm from the origin"));
}

TEST_CASE("a tool thinner than two voxels has samples half a voxel apart, unless it says a pitch") {
  const TemporaryFolder folder;
  const auto pitch_of = [&](const std::string& lines) {
    return load_scene(block_scene(folder, 0.125, "[[tool]]\n" + lines)).tools[0].pitch_mm;
  };
  CHECK(pitch_of("shape = \"cone\"\nradius_mm = 0.124\n") == 0.0625);
  CHECK(pitch_of("shape = \"ball\"\nradius_mm = 0.0625\n") == 0.0625);
  CHECK(pitch_of("shape = \"cone\"\nradius_mm = 0.125\n") == 0.125);
  CHECK(pitch_of("shape = \"cone\"\nradius_mm = 0.1\npitch_mm = 0.125\n") == 0.125);
  CHECK(pitch_of("shape = \"ball\"\nsize_vox = 1\n") == 0.125);
}

TEST_CASE("a tool that does not suit the volume is reported with its line and the numbers") {
  const TemporaryFolder folder;
  const auto error_with = [&](const std::string& lines) {
    return load_error(block_scene(folder, 0.125, "[[tool]]\n" + lines));
  };
  const std::string ball = "shape = \"ball\"\n", shaft = ball + "radius_mm = 1\nshaft_length_mm = ";
  const std::string limit = ", above the limit of 64";
  for (const auto& [lines, why] : std::vector<std::pair<std::string, std::string>>{
           {ball + "radius_mm = 0.02\n",
            "scene.toml:5: tool.radius_mm = 0.02 is below half a voxel (0.0625); "},
           {ball + "radius_mm = 999\n", limit},
           {ball + "size_vox = 65\n",
            "scene.toml:5: tool.size_vox = 65 makes a tool of 65 samples along a side" + limit},
           {"shape = \"cylinder\"\nradius_mm = 0.5\nlength_mm = 9\n",
            "72 samples along its length" + limit},
           {ball + "radius_mm = 1\npitch_mm = 0.01\n",
            "201 samples along a side" + limit + "; use a smaller tool or a coarser pitch"},
           {ball + "size_vox = 16\npitch_mm = 0.001\n",
            "scene.toml:5: tool.size_vox = 16 makes a tool of 0.016 mm, below a voxel"},
           {ball + "size_vox = 30\n",
            "scene.toml:5: tool.size_vox = 30 makes a tool of 3.75 mm, larger than the volume "
            "(3.25 mm)"},
           {ball + "size_vox = 8\npitch_mm = 0.2\n",
            "scene.toml:6: tool.pitch_mm = 0.2 is above the smallest voxel edge"},
           {shaft + "2\nshaft_radius_mm = 0.5\n",
            "scene.toml:6: tool.shaft_length_mm = 2 ends no farther than the head"},
           {shaft + "9\nshaft_radius_mm = 0.06\n",
            " is of a shaft thinner than a voxel (0.125 mm)"}}) {
    CAPTURE(lines);
    CHECK(has(error_with(lines), why));
  }
  CHECK(error_with(shaft + "2.1\nshaft_radius_mm = 0.5\n").empty());
  const auto planned = [&](const std::string& lines) {
    const auto path = block_scene(folder, 0.125, "[[tool]]\n" + shaft + lines);
    return test::error_of([&] { static_cast<void>(plan_scene(load_scene(path))); });
  };
  CHECK(planned("12\nshaft_radius_mm = 0.8\nhandpiece_radius_mm = 5\n").empty());
  CHECK(has(planned("12\nshaft_radius_mm = 0.8\nhandpiece_radius_mm = 50\n"),
            "tool 'ball 1 mm': its handpiece has a surface of "));
  CHECK(has(planned("200\nshaft_radius_mm = 0.8\n"), "tool 'ball 1 mm': its shaft reaches "));
}

TEST_CASE("a mesh that does not suit the volume is reported with what to do about it") {
  const TemporaryFolder folder;
  const auto error_of_bar = [&](double aside, const char* lines) {
    std::vector<LooseTriangle> triangles = extremes::prism(0.5, 1, 4);
    for (LooseTriangle& t : triangles) {
      for (auto& corner : t) corner[2] += static_cast<float>(aside);
    }
    static_cast<void>(folder.write("bur.stl", text_stl(triangles)));
    return load_error(block_scene(
        folder, 0.125, "[[tool]]\nshape = \"stl\"\nfile = \"bur.stl\"\n" + std::string(lines)));
  };
  CHECK(error_of_bar(0, "").empty());
  CHECK(error_of_bar(0.4, "").empty());  // askew, but around its axis
  CHECK(has(
      error_of_bar(2, ""),
      "scene.toml:5: tool.file = \"bur.stl\" lies beside its axis, the file's y: z goes from "));
  CHECK(has(error_of_bar(0, "scale = 30\n"),
            " samples along a side, above the limit of 64; use a smaller scale"));
  CHECK(has(error_of_bar(0, "scale = 5\n"), " mm); use a smaller scale"));
  // What was computed is told in six digits.
  CHECK(has(error_of_bar(0, "scale = 0.1\n"), "reaches less than half a voxel (0.0625 mm)"));
}

TEST_CASE("a tool with more surface than contact can read is reported with the scene and count") {
  const TemporaryFolder folder;
  LoadedScene scene =
      load_scene(block_scene(folder, 0.125, "[[tool]]\nshape = \"ball\"\nradius_mm = 1.5\n"));
  scene.tools[0].radius_mm = 150;
  scene.tools[0].length_mm = 300;
  const std::string error = test::error_of([&] { static_cast<void>(plan_scene(scene)); });
  CAPTURE(error);
  CHECK(has(error, "scene.toml: tool 'ball 1.5 mm': "));
  CHECK_FALSE(has(error, "e+"));
}

TEST_CASE("real volumes load with any scene, by their size in voxels") {
  const auto scene_path = std::filesystem::path(KERF_SCENES_DIR) / "phantom.toml";
  for (const std::string file :
       {"ge_tooth_16bit/tooth.nhdr", "ct_spine_pelvis/example_ct.nii.gz"}) {
    CAPTURE(file);
    SceneOverrides overrides;
    overrides.volume_file = test::real_data(file);
    if (!overrides.volume_file.has_value()) continue;
    const LoadedScene scene = load_scene(scene_path, overrides);
    CHECK(scene.tools.at(0).offsets.size() == 2176);
    MESSAGE(file << ": scale " << scene.device.workspace_scale << ", iso " << scene.volumes[0].iso
                 << ", offset y " << scene.device.offset_mm[1] << ", hand unit "
                 << hand_unit_mm(scene) << ", machinability "
                 << scene.cut.machinability_mm3_per_s_n);
  }
}

namespace {

constexpr Matrix3 kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

SceneVolume volume_of(VoxelGrid grid, Point3 spacing_mm, std::vector<Density> density,
                      const Matrix3& orientation, Point3 middle_mm) {
  SceneVolume volume;
  volume.name = "test";
  volume.image.grid = grid;
  volume.image.spacing_mm = spacing_mm;
  volume.image.density = std::move(density);
  volume.pose = place_volume(volume.image, orientation, middle_mm);
  return volume;
}

void check_near(const Point3& a, const Point3& b, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i) CHECK(std::abs(a[i] - b[i]) <= tolerance);
}

/// A unit quaternion with w >= 0 and no component near a sign change.
std::array<double, 4> any_quaternion() {
  std::array<double, 4> q{};
  double square = 0;
  for (double& component : q) {
    component = in_range(-1000, 1001) / 1000.0;
    square += component * component;
  }
  if (!(square > 0.01 && std::abs(q[3]) > 1e-3)) discard();
  const double scale = (q[3] < 0 ? -1 : 1) / std::sqrt(square);
  for (double& component : q) component *= scale;
  return q;
}

}  // namespace

TEST_CASE("a quaternion and its rotation matrix are the same rotation") {
  CHECK(property([] {
    const auto q = any_quaternion();
    const auto back = quaternion_of(rotation_of(q));
    for (std::size_t i = 0; i < 4; ++i) HOLDS(std::abs(q[i] - back[i]) < 1e-9);
  }));
  // Half turns, where w is zero.
  CHECK(quaternion_of({1, 0, 0, 0, -1, 0, 0, 0, -1}) == std::array<double, 4>{1, 0, 0, 0});
  CHECK(quaternion_of({-1, 0, 0, 0, 1, 0, 0, 0, -1}) == std::array<double, 4>{0, 1, 0, 0});
  CHECK(quaternion_of({-1, 0, 0, 0, -1, 0, 0, 0, 1}) == std::array<double, 4>{0, 0, 1, 0});
}

TEST_CASE("a standing source has its z axis up and its y axis away from the user") {
  check_near(rotated(kSourceStanding, {1, 2, 3}), {1, 3, -2}, 0);
  const auto q = quaternion_of(kSourceStanding);
  CHECK(q[0] == doctest::Approx(-std::sqrt(0.5)));
  CHECK(q[3] == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE("the middle of the box comes to the wanted place, in any pose") {
  CHECK(property([] {
    const Matrix3 rotation = rotation_of(any_quaternion());
    const auto volume =
        volume_of({5, 6, 7}, {0.5, 1, 2}, std::vector<Density>(210), rotation, {1, -2, 3});
    const WorldBox box = world_box(volume);
    const Point3 wanted = {1, -2, 3};
    for (std::size_t i = 0; i < 3; ++i) {
      HOLDS(std::abs((box.lo_mm[i] + box.hi_mm[i]) / 2 - wanted[i]) < 1e-9);
      double reach = 0;
      const Point3 side = {2.5, 6, 14};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        reach += std::abs(rotation[3 * i + axis]) * side[axis];
      }
      HOLDS(std::abs(box.hi_mm[i] - box.lo_mm[i] - reach) < 1e-9);
    }
  }));
}

TEST_CASE("the directions of the file come before the orientation of the scene") {
  VolumeImage image;
  image.grid = {3, 3, 3};
  image.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // its x axis is the source's y
  const Pose pose = place_volume(image, kSourceStanding, {0, 0, 0});
  check_near(rotated(rotation_of(pose.orientation), {1, 0, 0}), {0, 0, -1}, 1e-12);
}

TEST_CASE("a hand from above meets a slab where its density passes iso") {
  // Top face: density 1 at z = 5, 0 at z = 6; iso 0.25 is met three quarters of the way up.
  const VoxelGrid grid{9, 9, 12};
  auto volume = volume_of(grid, {0.5, 0.5, 0.2}, block(grid, {{0, 0, 2}, {9, 9, 6}}, 60000),
                          kSourceStanding, {10, 0, -4});
  volume.iso = 15000;
  const double top_mm = (5.75 - 5.5) * 0.2;  // from the middle of the box
  check_near(first_surface_from_above(volume), {10, top_mm, -4}, 0.002);
}

TEST_CASE("where the middle is empty the nearest column is met, at its top") {
  // Two pillars: the nearer one is lower.
  const VoxelGrid grid{20, 20, 20};
  auto density = block(grid, {{13, 9, 2}, {14, 10, 6}}, 65535);
  const auto far = block(grid, {{1, 2, 2}, {3, 5, 18}}, 65535);
  for (std::size_t i = 0; i < density.size(); ++i) density[i] = std::max(density[i], far[i]);
  auto volume = volume_of(grid, {1, 1, 1}, density, kIdentity, {9.5, 9.5, 9.5});
  volume.iso = 32768;
  // Identity: y is up, so the pillar x = 13, y = 9, z = 2..5 has its top half a voxel above y = 9;
  // its voxel nearest to the middle is the one at z = 5.
  check_near(first_surface_from_above(volume), {13, 9.5, 5}, 0.01);
}

TEST_CASE("a lone voxel is found in any pose, and its surface is at iso") {
  CHECK(property([] {
    const VoxelGrid grid{9, 8, 7};
    const std::int32_t x = in_range(1, 8), y = in_range(1, 7), z = in_range(1, 6);
    auto volume =
        volume_of(grid, {1, 0.5, 2}, block(grid, {{x, y, z}, {x + 1, y + 1, z + 1}}, 40000),
                  rotation_of(any_quaternion()), {3, 2, 1});
    volume.iso = static_cast<Density>(in_range(1, 40001));
    const Point3 hit = first_surface_from_above(volume);
    Point3 voxel = rotated(rotation_of(volume.pose.orientation), {x * 1.0, y * 0.5, z * 2.0});
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      voxel[i] += volume.pose.position_mm[i];
      square += (hit[i] - voxel[i]) * (hit[i] - voxel[i]);
    }
    HOLDS(hit[1] >= voxel[1] - 2.3);  // within the cells around the voxel
    HOLDS(std::sqrt(square) <= 2.3);
  }));
}

TEST_CASE("a volume without anything solid has no surface, and says so") {
  const VoxelGrid grid{4, 4, 4};
  const auto volume = volume_of(grid, {1, 1, 1}, std::vector<Density>(64, 100), kIdentity, {});
  const std::string error =
      test::error_of([&] { static_cast<void>(first_surface_from_above(volume)); });
  CHECK(has(error, "no voxel reaches the iso density"));
}

}  // namespace kerf::scene_load_test
