// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_file.hpp"

#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/scene/scene_presets.hpp"
#include "tests/scene/support.hpp"

namespace {

// Five lines, so that what is appended begins on line 6.
const std::string kSmallest =
    "[[volume]]\n"
    "file = \"phantom\"\n"
    "[[tool]]\n"
    "shape = \"ball\"\n"
    "size_vox = 16\n";

kerf::Scene parse(const std::string& text) {
  return kerf::parse_scene(text, "scenes/x.toml");
}

std::string error_of(const std::string& text) {
  return kerf::test::error_of([&] { static_cast<void>(parse(text)); });
}

/// The error when `lines` are appended to the smallest scene.
std::string error_after(const std::string& lines) {
  return error_of(kSmallest + lines);
}

/// The error when one line of the smallest scene is replaced.
std::string error_with(const std::string& line, const std::string& instead) {
  std::string text = kSmallest;
  return error_of(text.replace(text.find(line), line.size(), instead));
}

bool begins(const std::string& text, const std::string& with) {
  return text.rfind(with, 0) == 0;
}

}  // namespace

TEST_CASE("the smallest scene takes every default") {
  const kerf::Scene scene = parse(kSmallest);
  REQUIRE(scene.volumes.size() == 1);
  CHECK(scene.volumes[0].name == "phantom");
  CHECK(scene.volumes[0].crop);
  CHECK(scene.volumes[0].solid);
  CHECK_FALSE(scene.volumes[0].iso);  // Otsu
  CHECK_FALSE(scene.volumes[0].orientation);
  REQUIRE(scene.tools.size() == 1);
  CHECK(scene.tools[0].name == "ball 16 vox");
  CHECK(scene.tools[0].turns);
  CHECK_FALSE(scene.offset_given);
  CHECK_FALSE(scene.device.torque_scale);  // motors off
  CHECK(scene.device.personality == kerf::Personality::omni);
  CHECK(scene.force.model == kerf::ForceModel::proxy);
  CHECK(scene.force.stiffness_n_per_mm == 0.4);
  CHECK(scene.cut.model == kerf::CutModel::preston);
  CHECK(scene.limits.force_n == 3.3);
  CHECK(scene.servo.rate_hz == 1000);
  CHECK(scene.servo.numeric == kerf::NumericKind::fixed);
  CHECK(scene.servo.kernel == kerf::GradientKernel::farid);
  REQUIRE(scene.materials.size() == 4);
  CHECK(scene.materials[0].name == "none");
  CHECK(scene.materials[1].name == "enamel");
  CHECK(scene.materials[2].name == "dentin");
  CHECK(scene.materials[3].name == "pulp");
  CHECK(scene.hand_script.empty());
}

TEST_CASE("every key reaches its place") {
  const kerf::Scene scene = parse(R"(
    scene.title = "a jaw"
    [[volume]]
    file = "ct/a.nrrd"
    name = "jaw"
    spacing_mm = [0.1, 0.2, 0.3]
    window = [-100, 900]
    iso = 0.4
    crop = false
    pose = { position_mm = [1, 2, 3], orientation = [0, 0, 0.7071, 0.7071] }
    [[volume]]
    file = "phantom"
    size = [64, 64, 40]
    iso = "otsu"
    solid = false
    [[tool]]
    name = "disc"
    shape = "wheel"
    radius_mm = 2
    length_mm = 0.5
    turns = false
    pitch_mm = 0.05
    [[material]]
    name = "pulp"
    machinability = 7
    [[material]]
    name = "bone"
    iso = 0.3
    colour = [1, 0.5, 0]
    [device]
    personality = "omni"
    workspace_scale = 2
    offset_mm = [4, 5, 6]
    torque_scale = [0.3, -0.4, 0.5]
    dock_rad = [0, 0.25, -0.4]
    [force]
    model = "paper"
    p0_n_per_mm2 = 0.1
    [cut]
    model = "overlap_exact"
    rate_per_s = 12
    p1_n_per_mm2 = 0.2
    [limits]
    force_n = 2
    slew_n_per_ms = 0.3
    continuous_force_n = 0.5
    speed_mm_per_s = 800
    [servo]
    rate_hz = 4000
    numeric = "double"
    kernel = "sobel5"
    [hand]
    script = "hands/touch.toml"
  )");
  const kerf::VolumeSpec& jaw = scene.volumes.at(0);
  CHECK(scene.title == "a jaw");
  CHECK(jaw.where == "scenes/x.toml:4");
  CHECK(jaw.name == "jaw");
  CHECK(jaw.spacing_mm == std::array<double, 3>{0.1, 0.2, 0.3});
  CHECK(jaw.window == std::array<double, 2>{-100, 900});
  CHECK(jaw.iso == 0.4);
  CHECK_FALSE(jaw.crop);
  CHECK(jaw.position_mm == std::array<double, 3>{1, 2, 3});
  CHECK((*jaw.orientation)[2] == doctest::Approx(std::sqrt(0.5)).epsilon(1e-12));  // normalised
  CHECK(scene.volumes.at(1).phantom_size == kerf::VoxelGrid{64, 64, 40});
  CHECK_FALSE(scene.volumes.at(1).solid);
  CHECK(scene.tools.at(0).name == "disc");
  CHECK(scene.tools.at(0).size.length_mm == 0.5);
  CHECK_FALSE(scene.tools.at(0).turns);
  CHECK(scene.tools.at(0).pitch_given);
  CHECK(scene.materials.at(3).machinability == 7);
  CHECK(scene.materials.at(3).iso == kerf::default_materials().at(3).iso);
  CHECK(scene.materials.at(4).name == "bone");
  CHECK(scene.offset_given);
  CHECK(scene.device.offset_mm == std::array<double, 3>{4, 5, 6});
  CHECK(scene.device.torque_scale == std::array<double, 3>{0.3, -0.4, 0.5});
  CHECK(scene.device.dock_rad == std::array<double, 3>{0, 0.25, -0.4});
  CHECK(scene.cut.model == kerf::CutModel::overlap_exact);
  CHECK(scene.cut.rate_per_s == 12);
  CHECK(scene.limits.speed_mm_per_s == 800);
  CHECK(scene.servo.rate_hz == 4000);
  CHECK(scene.servo.numeric == kerf::NumericKind::float64);
  CHECK(scene.servo.kernel == kerf::GradientKernel::sobel5);
  CHECK(scene.hand_script == "scenes/hands/touch.toml");
}

TEST_CASE("an unknown key is shown with line, column and the key that was meant") {
  CHECK(error_after("[servo]\nrate = 1000\n") ==
        "scenes/x.toml:7:1: servo.rate is not a known key; did you mean servo.rate_hz (in Hz)?");
  CHECK(
      error_after("radius_cm = 0.1\n") ==
      "scenes/x.toml:6:1: tool.radius_cm is not a known key; did you mean tool.radius_mm (in mm)?");
  CHECK(error_after("radius = 0.1\n") ==
        "scenes/x.toml:6:1: tool.radius is not a known key; did you mean tool.radius_mm (in mm)?");
  CHECK(
      error_after("  lenght_mm = 1\n") ==
      "scenes/x.toml:6:3: tool.lenght_mm is not a known key; did you mean tool.length_mm (in mm)?");
  CHECK(error_after("[cut]\np1_n = 1\n") ==
        "scenes/x.toml:7:1: cut.p1_n is not a known key; did you "
        "mean cut.p1_n_per_mm2 (in N/mm^2)?");
  CHECK(error_after("[servos]\nrate_hz = 1000\n") ==
        "scenes/x.toml:6:2: servos is not a known key; did you mean servo?");
  CHECK(error_after("[hand]\nqqqqqqqqqqqq = 1\n") ==
        "scenes/x.toml:7:1: hand.qqqqqqqqqqqq is not a known key; known here: script");
  CHECK(error_with("file = \"phantom\"", "file = \"phantom\"\npose = { position = [0, 0, 0] }") ==
        "scenes/x.toml:3:10: volume.pose.position is not a known key; did you mean "
        "volume.pose.position_mm (in mm)?");
}

TEST_CASE("of several unknown keys the first in the file is reported") {
  CHECK(begins(error_after("[servo]\nzzz = 1\naaa = 2\n"), "scenes/x.toml:7:1: servo.zzz"));
}

TEST_CASE("a value of the wrong type is reported with its line") {
  CHECK(error_after("[servo]\nrate_hz = \"fast\"\n") ==
        "scenes/x.toml:7: servo.rate_hz = \"fast\" is not a whole number; write one without point "
        "or exponent");
  CHECK(error_after("[servo]\nrate_hz = 1000.5\n") ==
        "scenes/x.toml:7: servo.rate_hz = 1000.5 is not a whole number; write one without point or "
        "exponent");
  CHECK(error_after("[limits]\nforce_n = \"3 N\"\n") ==
        "scenes/x.toml:7: limits.force_n = \"3 N\" is not a number; write one without quotes or "
        "unit");
  CHECK(begins(error_with("file = \"phantom\"", "file = 3"),
               "scenes/x.toml:2: volume.file = 3 is not text"));
  CHECK(begins(error_after("[device]\noffset_mm = [1, 2]\n"),
               "scenes/x.toml:7: device.offset_mm = [1, 2] is not a list of 3 numbers"));
  for (const std::string list : {"[1, 2, true]", "[1, 2, [3]]", "[1, 2, \"3\"]"}) {
    CHECK(error_after("[device]\noffset_mm = " + list + "\n") ==
          "scenes/x.toml:7: device.offset_mm = " + list +
              " is not a list of 3 numbers; write [x, y, z]");
  }
  CHECK(begins(error_after("[servo]\nrate_hz = 1979-05-27\n"),
               "scenes/x.toml:7: servo.rate_hz = 1979-05-27 is not a whole number"));
  CHECK(begins(error_after("[servo]\nrate_hz = 07:32:00.5\n"),
               "scenes/x.toml:7: servo.rate_hz = 07:32:00.5 is not a whole number"));
  CHECK(begins(error_after("[device]\ndock_rad = 0.2\n"),
               "scenes/x.toml:7: device.dock_rad = 0.2 is not a list"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\nsolid = 1"),
               "scenes/x.toml:3: volume.solid = 1 is not a switch"));
  CHECK(begins(error_with("[[tool]]", "[tool]"), "scenes/x.toml:3: tool = "));
  CHECK(error_with("[[tool]]", "[tool]").find("write [[tool]]") != std::string::npos);
  CHECK(begins(error_of("volume = []\n"), "scenes/x.toml:1: volume = [] is not a list of tables"));
  CHECK(begins(error_of("cut = 3\n" + kSmallest), "scenes/x.toml:1: cut = 3 is not a table"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\npose = 1"),
               "scenes/x.toml:3: volume.pose = 1 is not a table"));
}

TEST_CASE("a value out of range is reported with its line and the range") {
  CHECK(error_after("[limits]\nforce_n = 5\n") ==
        "scenes/x.toml:7: limits.force_n = 5 is out of range; use 0.01 to 3.3");
  CHECK(error_after("[servo]\nrate_hz = 100\n") ==
        "scenes/x.toml:7: servo.rate_hz = 100 is out of range; use 250 to 8000");
  CHECK(error_after("[device]\nworkspace_scale = 0\n") ==
        "scenes/x.toml:7: device.workspace_scale = 0 is out of range; use 0.01 to 100");
  CHECK(error_after("[cut]\nmodel = \"overlap\"\nrate_per_s = -1\n") ==
        "scenes/x.toml:8: cut.rate_per_s = -1 is out of range; use 0 to 100000, or \"1/T\"");
  CHECK(begins(error_after("[force]\nstiffness_n_per_mm = nan\n"),
               "scenes/x.toml:7: force.stiffness_n_per_mm = nan is out of range"));
  CHECK(begins(error_after("[force]\nstiffness_n_per_mm = inf\n"),
               "scenes/x.toml:7: force.stiffness_n_per_mm = inf is out of range"));
  CHECK(begins(error_after("[cut]\nthreshold_n = -1\n"),
               "scenes/x.toml:7: cut.threshold_n = -1 is out of range"));
  CHECK(begins(error_after("[limits]\nforce_n = 1\ncontinuous_force_n = 2\n"),
               "scenes/x.toml:8: limits.continuous_force_n = 2 is out of range; use 0.01 to 1"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\niso = 2"),
               "scenes/x.toml:3: volume.iso = 2 is out of range; use 0.0001 to 1, or \"otsu\""));
  CHECK(begins(error_with("size_vox = 16", "size_vox = 0"),
               "scenes/x.toml:5: tool.size_vox = 0 is out of range"));
  CHECK(begins(error_with("size_vox = 16", "radius_mm = -1"),
               "scenes/x.toml:5: tool.radius_mm = -1 is out of range"));
  const kerf::Scene zero = parse(std::string(kSmallest) + "[force]\ndamping_ns_per_mm = -0.0\n");
  CHECK_FALSE(std::signbit(zero.force.damping_ns_per_mm));  // -0 is a zero
  const std::string wooden = "[device]\npersonality = \"woodenhaptics\"\n";
  for (const char* list : {"[1, 0.5, 1]", "[1, 0, 1]"}) {
    CHECK(begins(error_after(wooden + "encoder_sign = " + list + "\n"),
                 std::string("scenes/x.toml:8: device.encoder_sign = ") + list +
                     " is not 1 or -1 at each joint"));
  }
  CHECK(begins(error_after(wooden + "encoder_sign = [1, 2, 1]\n"),
               "scenes/x.toml:8: device.encoder_sign = [1, 2, 1] is out of range; use -1 to 1"));
  CHECK(begins(error_after("[device]\nencoder_sign = [1, 1, -1]\n"),
               "scenes/x.toml:7: device.encoder_sign"));  // an Omni has none
  CHECK(begins(error_after("[device]\ntorque_scale = [0.3, 0.3, 0]\n"),
               "scenes/x.toml:7: device.torque_scale = [0.3, 0.3, 0] is below 0.001"));
}

TEST_CASE("a word that is not known is reported with those that are") {
  CHECK(error_with("\"ball\"", "\"bal\"") ==
        "scenes/x.toml:4: tool.shape = \"bal\" is unknown; did you mean \"ball\"? known: ball, "
        "cylinder, cone, inverted_cone, flame, wheel, pear, stl");
  CHECK(begins(error_after("[device]\npersonality = \"spacemouse\"\n"),
               "scenes/x.toml:7: device.personality = \"spacemouse\" is unknown"));
  CHECK(begins(error_after("[force]\nmodel = \"glue\"\n"),
               "scenes/x.toml:7: force.model = \"glue\" is unknown"));
  CHECK(begins(error_after("[cut]\nmodel = \"overlap\"\nrate_per_s = \"T\"\n"),
               "scenes/x.toml:8: cut.rate_per_s = \"T\" is unknown"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\niso = \"auto\""),
               "scenes/x.toml:3: volume.iso = \"auto\" is unknown; known: otsu, or 0.0001 to 1"));
  CHECK(error_with("file = \"phantom\"", "file = \"phantom\"\niso = \"otzu\"") ==
        "scenes/x.toml:3: volume.iso = \"otzu\" is unknown; did you mean \"otsu\"? known: otsu, "
        "or 0.0001 to 1");
}

TEST_CASE("what contradicts itself or is missing is reported with its line") {
  CHECK(begins(error_of("[[tool]]\nshape = \"ball\"\nsize_vox = 3\n"),
               "scenes/x.toml: no [[volume]]"));
  CHECK(begins(error_of("[[volume]]\nfile = \"phantom\"\n"), "scenes/x.toml: no [[tool]]"));
  CHECK(begins(error_of(""), "scenes/x.toml: no [[volume]]"));
  CHECK(begins(error_with("file = \"phantom\"\n", ""), "scenes/x.toml:1: volume has no file"));
  CHECK(begins(error_with("shape = \"ball\"\n", ""), "scenes/x.toml:3: tool has no shape"));
  CHECK(begins(error_with("size_vox = 16\n", ""), "scenes/x.toml:3: tool needs either radius_mm"));
  CHECK(error_after("radius_mm = 1\n") ==
        "scenes/x.toml:6: tool.radius_mm = 1 contradicts size_vox; leave one of the two out");
  CHECK(begins(error_after("length_mm = 1\n"),
               "scenes/x.toml:6: tool.length_mm = 1 contradicts size_vox"));
  CHECK(begins(error_after("[[tool]]\nshape = \"ball\"\nradius_mm = 1\nlength_mm = 1\n"),
               "scenes/x.toml:9: tool.length_mm = 1 contradicts the ball"));
  CHECK(begins(error_after("[[tool]]\nshape = \"wheel\"\nradius_mm = 1\nlength_mm = 3\n"),
               "scenes/x.toml:9: tool.length_mm = 3 is more than the wheel's diameter"));
  CHECK(begins(error_after("[[tool]]\nshape = \"ball\"\nsize_vox = 16\n"),
               "scenes/x.toml:6: tool is the second named \"ball 16 vox\""));
  CHECK(begins(error_after("[[volume]]\nfile = \"phantom\"\n"),
               "scenes/x.toml:6: volume is the second named \"phantom\""));
  const std::string wax = "[[material]]\nname = \"wax\"\n";
  CHECK(error_after("[[material]]\nname = \"enamel\"\n" + wax).empty());
  CHECK(error_after(wax + wax) ==
        "scenes/x.toml:8: material is the second named \"wax\"; write "
        "one [[material]] with the keys of both");
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\nsolid = false"),
               "scenes/x.toml: no [[volume]] is solid"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\nspacing_mm = 0.2"),
               "scenes/x.toml:3: volume.spacing_mm = 0.2 is given with the phantom"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"a.nrrd\"\nsize = [64, 64, 64]"),
               "scenes/x.toml:3: volume.size = [64, 64, 64] only shapes the phantom"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"phantom\"\nsize = [64, 64.5, 64]"),
               "scenes/x.toml:3: volume.size = [64, 64.5, 64] counts voxels"));
  CHECK(begins(error_with("file = \"phantom\"", "file = \"a.nrrd\"\nwindow = [5, 5]"),
               "scenes/x.toml:3: volume.window = [5, 5] is empty"));
  CHECK(begins(error_with("file = \"phantom\"",
                          "file = \"phantom\"\npose = { orientation = [0, 0, 0, 0.5] }"),
               "scenes/x.toml:3: volume.pose.orientation = [0, 0, 0, 0.5] has length 0.5"));
  CHECK(begins(error_after("[[material]]\niso = 0.5\n"), "scenes/x.toml:6: material has no name"));
  CHECK(begins(error_after("[[material]]\nname = \"none\"\n"),
               "scenes/x.toml:7: material.name = \"none\" is air"));
}

TEST_CASE("a shaft that is half said, too wide or not felt is reported with its line") {
  const auto error_with_shaft = [](const std::string& lines) { return error_after(lines); };
  CHECK(error_with_shaft("shaft_radius_mm = 0.5\nshaft_length_mm = 9\n").empty());
  CHECK(
      error_with_shaft("shaft_radius_mm = 0.5\n") ==
      "scenes/x.toml:6: tool.shaft_radius_mm = 0.5 has no length; write shaft_length_mm, from the "
      "tool's tip to the shaft's end");
  CHECK(error_with_shaft("shaft_length_mm = 9\n") ==
        "scenes/x.toml:6: tool.shaft_length_mm = 9 has no radius; write shaft_radius_mm");
  CHECK(error_with_shaft("handpiece_radius_mm = 5\n") ==
        "scenes/x.toml:6: tool.handpiece_radius_mm = 5 has no shaft to hold; write shaft_radius_mm "
        "and shaft_length_mm");
  const std::string shaft = "shaft_radius_mm = 0.5\nshaft_length_mm = 9\n";
  CHECK(error_with_shaft(shaft + "handpiece_length_mm = 5\n") ==
        "scenes/x.toml:8: tool.handpiece_length_mm = 5 has no radius; write handpiece_radius_mm");
  CHECK(error_with_shaft(shaft + "handpiece_radius_mm = 0.4\n") ==
        "scenes/x.toml:8: tool.handpiece_radius_mm = 0.4 is narrower than the shaft; use at least "
        "0.5");
  CHECK(error_with_shaft(shaft + "handpiece_radius_mm = 0.5\n").empty());
  for (const char* key :
       {"shaft_radius_mm", "shaft_length_mm", "handpiece_radius_mm", "handpiece_length_mm"}) {
    CHECK(
        begins(error_with_shaft(key + std::string(" = -1\n")),
               "scenes/x.toml:6: tool." + std::string(key) + " = -1 is out of range; use 0.0001"));
  }
  CHECK(error_with_shaft(shaft + "[force]\nmodel = \"paper\"\n") ==
        "scenes/x.toml:7: tool.shaft_length_mm = 9 is felt by a proxy alone; set force.model = "
        "\"proxy\", or leave the shaft out");
}

TEST_CASE("too many tools are refused") {
  std::string text = kSmallest;
  for (int i = 0; i < 16; ++i) {
    text += "[[tool]]\nname = \"" + std::to_string(i) + "\"\nshape = \"ball\"\nsize_vox = 3\n";
  }
  CHECK(error_of(text).find("has 17 entries; use at most 16") != std::string::npos);
}

TEST_CASE("broken TOML is reported in one line with line and column") {
  const std::string kSyntax = "correct the TOML syntax here";
  const std::string kRange =
      "is out of the range of numbers; use a whole number of 64 bits, or one up to 1e308";
  const std::vector<std::pair<std::string, std::string>> all{
      {"[servo\n", kSyntax},
      {"a = \n", kSyntax},
      {"[[volume]\n", kSyntax},
      {"x = 0x\n", kSyntax},
      {"x = 1e400\n", "1e400 " + kRange},
      {"x = -1e999\n", "1e999 " + kRange},
      {"x = 99999999999999999999\n", "99999999999999999999 " + kRange},
      {"\"\n", "close it, or copy it again"},
      {"x = \"abc\n", "close its quotes"},
      {"\xff\xfe\n", "save it as UTF-8"},
      {"s = \"\"\"never\nending", "close it, or copy it again"},
      {"x = " + std::string(300, '['), "more than 256 deep; write fewer"}};
  for (const auto& [broken, way_out] : all) {
    CAPTURE(broken);
    const std::string error = error_after(broken);
    CHECK(begins(error, "scenes/x.toml:"));
    CHECK(error.find('\n') == std::string::npos);
    CHECK(error.ends_with(way_out));
  }
  CHECK(begins(error_after("[servo\n"), "scenes/x.toml:6:7: "));
  for (const char* doubled : {"a = 1\na = 2\n", "[a]\n[a]\n"}) {
    CHECK(error_after(doubled).find(" existing ") != std::string::npos);
    CHECK(error_after(doubled).ends_with("; leave one of the two out"));
  }
  CHECK(error_after("[device]\npersonality = omni\n").ends_with("; text stands in quotes"));
}

TEST_CASE("control characters never reach a message or a name") {
  const std::string error = error_with("\"phantom\"", "\"a\\nb\\u001b[31m\"");
  CHECK(begins(error, "scenes/x.toml:2: volume.file = "));
  CHECK(error.find_first_of("\n\x1b") == std::string::npos);
}

TEST_CASE("a scene file that is not there, no file or a huge one is refused") {
  const kerf::test::TempFolder folder;
  const auto missing =
      kerf::test::error_of([] { static_cast<void>(kerf::parse_scene_file("/nowhere/x.toml")); });
  CHECK(begins(missing, "/nowhere/x.toml: no such scene file"));
  const auto huge = folder.write("huge.toml", std::string((1 << 20) + 1, '#'));
  CHECK(kerf::test::error_of([&] {
          static_cast<void>(kerf::parse_scene_file(huge));
        }).find("larger than 1 MiB") != std::string::npos);
  const auto loop = huge.parent_path() / "loop.toml";
  std::filesystem::create_symlink("loop.toml", loop);
  CHECK(begins(kerf::test::error_of([&] { static_cast<void>(kerf::parse_scene_file(loop)); }),
               loop.string() + ": cannot be reached (Too many levels of symbolic links); "));
  CHECK(kerf::test::error_of([] {
          static_cast<void>(kerf::parse_scene_file("/proc/self/mem"));  // as a disk that fails
        }) == "/proc/self/mem: cannot be read; copy it again, or check its disk");
  for (const auto& none : {huge.parent_path(), std::filesystem::path("/dev/null")}) {
    CHECK(kerf::test::error_of([&] { static_cast<void>(kerf::parse_scene_file(none)); }) ==
          none.string() + ": is no regular file; name a scene file");
  }
}

TEST_CASE("a hand script that is not there is refused where one asks") {
  const kerf::test::TempFolder folder;
  const auto file = folder.write("x.toml", kSmallest + "[hand]\nscript = \"hand.toml\"\n");
  const kerf::Scene scene = kerf::parse_scene_file(file);
  const auto error = [](const kerf::Scene& of) {
    return kerf::test::error_of([&] { kerf::check_hand_script(of); });
  };
  CHECK(error(scene) ==
        file.string() +
            ":7: hand.script = \"hand.toml\" is no file in the scene's folder; copy "
            "the script there, or name one by its whole path");
  folder.write("hand.toml", "");
  CHECK(error(scene).empty());
  CHECK(error(parse(kSmallest)).empty());
}

TEST_CASE("a bur of ISO 6360 stands for shape, radius, neck and name, and its table may say more") {
  const auto tool_of = [](const std::string& lines) {
    return parse("[[volume]]\nfile = \"phantom\"\n[[tool]]\n" + lines).tools.at(0);
  };
  const kerf::ToolSpec round = tool_of("bur = \"001 014\"\n");
  CHECK(round.name == "round 014");
  CHECK(round.shape == "ball");
  CHECK(round.size.radius_mm == doctest::Approx(0.7));
  CHECK(*round.shaft.radius_mm == doctest::Approx(0.42));
  CHECK(*round.shaft.length_mm == 8);
  CHECK(*tool_of("bur = \"010 050\"\n").shaft.radius_mm == 0.8);  // no thicker than the shank
  const kerf::ToolSpec own =
      tool_of("bur = \"107 012\"\nname = \"mine\"\nlength_mm = 5\nshaft_length_mm = 11\n");
  CHECK(own.name == "mine");
  CHECK(*own.size.length_mm == 5);
  CHECK(*own.shaft.length_mm == 11);

  const auto refused = [&](const std::string& lines) {
    return error_of("[[volume]]\nfile = \"phantom\"\n[[tool]]\n" + lines);
  };
  for (const char* unknown :
       {"\"002 014\"", "\"001 004\"", "\"001 051\"", "\"249 032\"", "\"001014\"", "\"001 01\"",
        "\"001 0140\"", "\"001 -14\"", "\"ball\""}) {
    CAPTURE(unknown);
    CHECK(begins(refused("bur = " + std::string(unknown) + "\n"),
                 "scenes/x.toml:4: tool.bur = " + std::string(unknown) +
                     " is no bur; write its head and its diameter in tenths of a mm, such as"));
  }
  for (const char* also :
       {"shape = \"ball\"", "radius_mm = 1", "size_vox = 16", "file = \"a.stl\""}) {
    CAPTURE(also);
    CHECK(begins(refused("bur = \"001 014\"\n" + std::string(also) + "\n"),
                 "scenes/x.toml:4: tool.bur = \"001 014\" contradicts"));
  }
  const kerf::KeyOverride setting{"tool.bur", "\"001 999\""};
  CHECK(begins(kerf::test::error_of([&] {
                 static_cast<void>(kerf::parse_scene("[[volume]]\nfile = \"phantom\"\n[[tool]]\n",
                                                     "scenes/x.toml", kerf::scene_keys(),
                                                     {&setting, 1}));
               }),
               "scenes/x.toml: --set tool.bur = \"001 999\" is no bur;"));
  CHECK(begins(refused("bur = \"001 014\"\nlength_mm = 3\n"),
               "scenes/x.toml:5: tool.length_mm = 3 contradicts the ball"));
}

TEST_CASE("a file that an option names stands in no line, and its place says so") {
  const auto scene = [](std::span<const kerf::KeyOverride> settings) {
    return kerf::parse_scene("[[volume]]\nfile = \"phantom\"\n[[tool]]\nbur = \"001 014\"\n",
                             "scenes/x.toml", kerf::scene_keys(), settings);
  };
  const kerf::KeyOverride setting{"volume.file", "\"/x.nrrd\""};
  CHECK(scene({}).volumes[0].where == "scenes/x.toml:2");
  CHECK(scene({&setting, 1}).volumes[0].where == "scenes/x.toml: --set");
}

TEST_CASE("what the phantom is, is asked of the phantom only, and one of the known") {
  CHECK(parse(kSmallest).volumes[0].shape == kerf::kMolar);
  CHECK(begins(error_with("\"phantom\"", "\"phantom\"\nshape = \"tooth\""),
               "scenes/x.toml:3: volume.shape = \"tooth\" is unknown; known: molar"));
  CHECK(begins(error_with("\"phantom\"", "\"a.nrrd\"\nshape = \"wall\""),
               "scenes/x.toml:3: volume.shape = \"wall\" only shapes the phantom"));
}
