// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "controller/run/scene_check.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/posix/atomic_file.hpp"

using namespace kerf;
namespace fs = std::filesystem;

TEST_CASE("a scene tells up to which speed no tool is dragged in air, and warns of hands beyond") {
  LoadedScene scene;
  scene.tools = {make_tool("ball 1 mm", "ball", {.pitch_mm = 0.1, .radius_mm = 0.5}),
                 make_tool("fissure", "cylinder", {.pitch_mm = 0.1, .radius_mm = 0.5})};
  SceneCosts costs;
  CHECK(air_lines(scene, costs).empty());  // the paper's force drags nothing
  costs.air_speeds_mm_per_s = {2500, 1000};
  CHECK(air_lines(scene, costs) == "free_of_drag_m_per_s=1.00\n");
  costs.air_speeds_mm_per_s = {2500, 340};
  CHECK(air_lines(scene, costs) ==
        "free_of_drag_m_per_s=0.34\nnote=tool fissure is dragged in air, beside a surface, by a "
        "hand faster than 0.34 m/s; a higher rate or larger voxels raise that\n");
}

TEST_CASE("a volume that ends in a density that contact counts is told") {
  SceneVolume volume;
  volume.name = "scan";
  volume.image.grid = {5, 4, 3};
  volume.image.density.assign(volume.image.grid.voxel_count(), 0);
  volume.iso = Density{32000};
  volume.image.density[volume.image.grid.index(2, 2, 1)] = 65535;  // inside
  CHECK(border_line(volume).empty());
  for (const VoxelIndex at : {VoxelIndex{0, 2, 1}, VoxelIndex{4, 1, 1}, VoxelIndex{2, 0, 1},
                              VoxelIndex{2, 3, 1}, VoxelIndex{2, 2, 0}, VoxelIndex{2, 2, 2}}) {
    Density& border = volume.image.density[volume.image.grid.index(at.x, at.y, at.z)];
    border = 3999;
    CHECK(border_line(volume).empty());
    border = 4000;
    CHECK(border_line(volume) ==
          "note=scan ends in a density of 0.061, of an iso of 0.488, and air is 0: a fast tool may "
          "feel that step; give it a window that begins at its air\n");
    volume.solid = false;
    CHECK(border_line(volume).empty());
    volume.solid = true;
    border = 0;
  }
}

TEST_CASE("no output of a run takes the place of a file of its scene") {
  std::string pattern = (fs::temp_directory_path() / "kerf-check-XXXXXX").string();
  REQUIRE(mkdtemp(pattern.data()) != nullptr);
  const fs::path folder = pattern;
  for (const char* name : {"scene", "hand", "ct.nrrd", "ct-labels.nrrd", "rest-b.nrrd", "bur"}) {
    std::ofstream(folder / name) << "mine";
  }
  LoadedScene scene;
  scene.path = (folder / "scene").string();
  scene.hand_script = (folder / "hand").string();
  scene.volume_specs.resize(2);
  scene.volume_specs[0].file = "ct.nrrd";
  scene.volume_specs[1].file = "rest-b.nrrd";
  scene.volumes.resize(2);
  scene.volumes[1].name = "b";
  scene.tool_specs.resize(2);
  scene.tool_specs[1].file = "bur";
  for (const char* name : {"scene", "hand", "bur"}) {
    ControllerOptions options;
    options.report = (folder / name).string();
    CHECK_THROWS_WITH_AS(check_run_files(options, scene),
                         doctest::Contains("is a file of this run itself"), FileError);
    std::swap(options.report, options.emulator_args);
    CHECK_THROWS_AS(check_run_files(options, scene), FileError);
  }
  // The second volume of rest.nrrd is rest-b.nrrd.
  for (const char* name : {"ct.nrrd", "ct-labels.nrrd", "rest.nrrd"}) {
    ControllerOptions options;
    options.final_volume = (folder / name).string();
    CAPTURE(name);
    CHECK_THROWS_WITH_AS(check_run_files(options, scene),
                         doctest::Contains("is a file of this run itself"), FileError);
  }
  ControllerOptions options;
  options.report = (folder / "report.json").string();
  options.final_volume = (folder / "final.nrrd").string();
  CHECK_NOTHROW(check_run_files(options, scene));
  scene.volume_specs[0].file = "final.mhd";  // has the labels of final.nrrd, but there are none
  CHECK_NOTHROW(check_run_files(options, scene));
  fs::remove_all(folder);
}
