// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_file.hpp"

#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/scene/scene_presets.hpp"
#include "tests/scene/support.hpp"
#include "tests/support/property.hpp"

namespace kerf::scene_file_test {

using namespace kerf::test;

namespace {

// Five lines, so that what is appended begins on line 6.
const std::string kSmallest =
    "[[volume]]\n"
    "file = \"phantom\"\n"
    "[[tool]]\n"
    "shape = \"ball\"\n"
    "size_vox = 16\n";

SceneSpec parse(const std::string& text) {
  return parse_scene(text, "scenes/x.toml");
}

std::string error_of(const std::string& text) {
  return test::error_of([&] { static_cast<void>(parse(text)); });
}

/// The smallest scene with `lines` at its end; with one part of it replaced; with a line below its
/// phantom.
std::string after(const std::string& lines) {
  return kSmallest + lines;
}
std::string with(const std::string& part, const std::string& instead) {
  std::string text = kSmallest;
  return text.replace(text.find(part), part.size(), instead);
}
std::string phantom(const std::string& line) {
  return with("\"phantom\"", "\"phantom\"\n" + line);
}

bool begins(const std::string& text, const std::string& with) {
  return text.rfind(with, 0) == 0;
}

/// A scene and what its error begins with behind the file's name; empty: it has none.
struct Line {
  std::string scene, error;
};
void check_lines(const std::vector<Line>& lines) {
  for (const auto& [scene, wanted] : lines) {
    const std::string error = error_of(scene);
    CAPTURE(error);
    CAPTURE(wanted);
    CHECK((wanted.empty() ? error.empty() : begins(error, "scenes/x.toml:" + wanted)));
  }
}

}  // namespace

TEST_CASE("the smallest scene takes every default") {
  const SceneSpec scene = parse(kSmallest);
  REQUIRE(scene.volumes.size() == 1);
  CHECK(scene.volumes[0].name == "phantom");
  CHECK(scene.volumes[0].shape == kMolar);
  CHECK(scene.volumes[0].crop);
  CHECK(scene.volumes[0].solid);
  CHECK_FALSE(scene.volumes[0].iso);  // Otsu
  CHECK_FALSE(scene.volumes[0].orientation);
  REQUIRE(scene.tools.size() == 1);
  CHECK(scene.tools[0].name == "ball 16 vox");
  CHECK(scene.tools[0].turns);
  CHECK_FALSE(scene.offset_given);
  CHECK_FALSE(scene.device.torque_scale);  // motors off
  CHECK(scene.device.personality == Personality::omni);
  CHECK(scene.force.model == ForceModel::proxy);
  CHECK(scene.force.stiffness_n_per_mm == 0.4);
  CHECK(scene.cut.model == CutModel::preston);
  CHECK(scene.limits.force_n == 3.3);
  CHECK(scene.servo.rate_hz == 1000);
  CHECK(scene.servo.numeric == NumericKind::fixed);
  CHECK(scene.servo.kernel == GradientKernel::farid);
  REQUIRE(scene.materials.size() == 4);
  CHECK(scene.materials[0].name == "none");
  CHECK(scene.materials[1].name == "enamel");
  CHECK(scene.materials[2].name == "dentin");
  CHECK(scene.materials[3].name == "pulp");
  CHECK(scene.hand_script.empty());
}

TEST_CASE("every key reaches its place") {
  const SceneSpec scene = parse(R"(
    scene.title = "a jaw"
    [[volume]]
    file = "ct/a.nrrd"
    name = "jaw"
    spacing_mm = [0.1, 0.2, 0.3]
    override_spacing_mm = 0.4
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
  const VolumeSpec& jaw = scene.volumes.at(0);
  CHECK(scene.title == "a jaw");
  CHECK(jaw.where == "scenes/x.toml:4");
  CHECK(jaw.name == "jaw");
  CHECK(jaw.spacing_mm == std::array<double, 3>{0.1, 0.2, 0.3});
  CHECK(jaw.override_spacing_mm == std::array<double, 3>{0.4, 0.4, 0.4});
  CHECK(jaw.window == std::array<double, 2>{-100, 900});
  CHECK(jaw.iso == 0.4);
  CHECK_FALSE(jaw.crop);
  CHECK(jaw.position_mm == std::array<double, 3>{1, 2, 3});
  CHECK((*jaw.orientation)[2] == doctest::Approx(std::sqrt(0.5)).epsilon(1e-12));  // normalised
  CHECK(scene.volumes.at(1).phantom_size == VoxelGrid{64, 64, 40});
  CHECK_FALSE(scene.volumes.at(1).solid);
  CHECK(scene.tools.at(0).name == "disc");
  CHECK(scene.tools.at(0).size.length_mm == 0.5);
  CHECK_FALSE(scene.tools.at(0).turns);
  CHECK(scene.tools.at(0).pitch_given);
  CHECK(scene.materials.at(3).machinability == 7);
  CHECK(scene.materials.at(3).iso == default_materials().at(3).iso);
  CHECK(scene.materials.at(4).name == "bone");
  CHECK(scene.offset_given);
  CHECK(scene.device.offset_mm == std::array<double, 3>{4, 5, 6});
  CHECK(scene.device.torque_scale == std::array<double, 3>{0.3, -0.4, 0.5});
  CHECK(scene.device.dock_rad == std::array<double, 3>{0, 0.25, -0.4});
  CHECK(scene.cut.model == CutModel::overlap_exact);
  CHECK(scene.cut.rate_per_s == 12);
  CHECK(scene.limits.speed_mm_per_s == 800);
  CHECK(scene.servo.rate_hz == 4000);
  CHECK(scene.servo.numeric == NumericKind::float64);
  CHECK(scene.servo.kernel == GradientKernel::sobel5);
  CHECK(scene.hand_script == "scenes/hands/touch.toml");
}

// Each row of the table of keys has its tests in scene_keys_test.cpp: wrong types, ends of ranges,
// unknown words, slips. Here: what is said of tables, of keys together, and whole lines of each
// kind once.

TEST_CASE("an unknown key is shown with line, column and the key that was meant") {
  check_lines({
      {after("[servo]\nrate = 1000\n"),
       "7:1: servo.rate is not a known key; did you mean servo.rate_hz (in Hz)?"},
      {after("radius = 0.1\n"),
       "6:1: tool.radius is not a known key; did you mean tool.radius_mm (in mm)?"},
      {after("  lenght_mm = 1\n"),
       "6:3: tool.lenght_mm is not a known key; did you mean tool.length_mm (in mm)?"},
      {after("[cut]\np1_n = 1\n"),
       "7:1: cut.p1_n is not a known key; did you mean cut.p1_n_per_mm2 (in N/mm^2)?"},
      {after("[servos]\nrate_hz = 1000\n"), "6:2: servos is not a known key; did you mean servo?"},
      {after("[hand]\nqqqqqqqqqqqq = 1\n"),
       "7:1: hand.qqqqqqqqqqqq is not a known key; known here: script"},
      {phantom("pose = { position = [0, 0, 0] }"),
       "3:10: volume.pose.position is not a known key; did you mean volume.pose.position_mm (in "
       "mm)?"},
      {after("[servo]\nzzz = 1\naaa = 2\n"), "7:1: servo.zzz"},  // the first of two
  });
}

TEST_CASE("a value of the wrong type or an unknown word is reported with its line") {
  check_lines({
      {after("[servo]\nrate_hz = \"fast\"\n"),
       "7: servo.rate_hz = \"fast\" is not a whole number; write one without point or exponent"},
      {after("[limits]\nforce_n = \"3 N\"\n"),
       "7: limits.force_n = \"3 N\" is not a number; write one without quotes or unit"},
      {after("[device]\noffset_mm = [1, 2, [3]]\n"),
       "7: device.offset_mm = [1, 2, [3]] is not a list of 3 numbers; write [x, y, z]"},
      {after("[device]\noffset_mm = [1, 2, \"3\"]\n"),
       "7: device.offset_mm = [1, 2, \"3\"] is not a list of 3"},
      {after("[servo]\nrate_hz = 07:32:00.5\n"),
       "7: servo.rate_hz = 07:32:00.5 is not a whole number"},
      {after("[device]\ndock_rad = 0.2\n"), "7: device.dock_rad = 0.2 is not a list"},
      {with("[[tool]]", "[tool]"), "3: tool = {..} is not a list of tables; write [[tool]]"},
      {"volume = []\n", "1: volume = [] is not a list of tables"},
      {"cut = 3\n" + kSmallest, "1: cut = 3 is not a table"},
      {phantom("pose = 1"), "3: volume.pose = 1 is not a table"},
      {with("\"ball\"", "\"bal\""),
       "4: tool.shape = \"bal\" is unknown; did you mean \"ball\"? known: ball, cylinder, cone, "
       "inverted_cone, flame, "
       "wheel, pear, stl"},
      {after("[cut]\nmodel = \"overlap\"\nrate_per_s = \"T\"\n"),
       "8: cut.rate_per_s = \"T\" is unknown"},
      {phantom("iso = \"otzu\""),
       "3: volume.iso = \"otzu\" is unknown; did you mean \"otsu\"? known: otsu, or 0.0001 to 1"},
      {phantom("shape = \"tooth\""), "3: volume.shape = \"tooth\" is unknown; known: molar"},
  });
}

TEST_CASE("a value out of range is reported with its line and the range") {
  const std::string wooden = "[device]\npersonality = \"woodenhaptics\"\nencoder_sign = ";
  check_lines({
      {after("[limits]\nforce_n = 5\n"),
       "7: limits.force_n = 5 is out of range for omni; use 0.01 to 3.3"},
      {after("[servo]\nrate_hz = 100\n"),
       "7: servo.rate_hz = 100 is out of range; use 250 to 8000"},
      {after("[cut]\nmodel = \"overlap\"\nrate_per_s = -1\n"),
       "8: cut.rate_per_s = -1 is out of range; use 0 to 100000, or \"1/T\""},
      {after("[force]\nstiffness_n_per_mm = nan\n"),
       "7: force.stiffness_n_per_mm = nan is out of range"},
      {after("[limits]\nforce_n = 1\ncontinuous_force_n = 2\n"),
       "8: limits.continuous_force_n = 2 is out of range for omni; use 0.01 to 1"},
      {phantom("iso = 2"), "3: volume.iso = 2 is out of range; use 0.0001 to 1, or \"otsu\""},
      {after(wooden + "[1, 0.5, 1]\n"),
       "8: device.encoder_sign = [1, 0.5, 1] is not 1 or -1 at each joint"},
      {after(wooden + "[1, 0, 1]\n"),
       "8: device.encoder_sign = [1, 0, 1] is not 1 or -1 at each joint"},
      {after(wooden + "[1, 2, 1]\n"),
       "8: device.encoder_sign = [1, 2, 1] is out of range; use -1 to 1"},
      {after("[device]\nencoder_sign = [1, 1, -1]\n"),
       "7: device.encoder_sign"},  // an Omni has none
      {after("[device]\ntorque_scale = [0.3, 0.3, 0]\n"),
       "7: device.torque_scale = [0.3, 0.3, 0] is below 0.001"},
  });
  const SceneSpec zero = parse(kSmallest + "[force]\ndamping_ns_per_mm = -0.0\n");
  CHECK_FALSE(std::signbit(zero.force.damping_ns_per_mm));  // -0 is a zero
}

TEST_CASE("what contradicts itself or is missing is reported with its line") {
  const std::string wax = "[[material]]\nname = \"wax\"\n";
  const std::string shaft = "shaft_radius_mm = 0.5\nshaft_length_mm = 9\n";
  std::string tools = kSmallest;
  for (int i = 0; i < 16; ++i) {
    tools += "[[tool]]\nname = \"" + std::to_string(i) + "\"\nshape = \"ball\"\nsize_vox = 3\n";
  }
  check_lines({
      {"", " no [[volume]]"},
      {"[[volume]]\nfile = \"phantom\"\n", " no [[tool]]"},
      {tools,
       "3: tool = [{..}, {..}, {..}, {..}, {..}, {..}, {..}, {..}, {..}, {..},... has 17 entries; "
       "use at most 16"},
      {with("file = \"phantom\"\n", ""), "1: volume has no file"},
      {with("shape = \"ball\"\n", ""), "3: tool has no shape"},
      {with("size_vox = 16\n", ""), "3: tool needs either radius_mm"},
      {after("radius_mm = 1\n"),
       "6: tool.radius_mm = 1 contradicts size_vox; leave one of the two out"},
      {after("length_mm = 1\n"), "6: tool.length_mm = 1 contradicts size_vox"},
      {after("[[tool]]\nshape = \"ball\"\nradius_mm = 1\nlength_mm = 1\n"),
       "9: tool.length_mm = 1 contradicts the ball"},
      {after("[[tool]]\nshape = \"wheel\"\nradius_mm = 1\nlength_mm = 3\n"),
       "9: tool.length_mm = 3 is more than the wheel's diameter"},
      {after("[[tool]]\nshape = \"ball\"\nsize_vox = 16\n"),
       "6: tool is the second named \"ball 16 vox\""},
      {after("[[volume]]\nfile = \"phantom\"\n"), "6: volume is the second named \"phantom\""},
      {after("[[material]]\nname = \"enamel\"\n" + wax), ""},
      {after(wax + wax),
       "8: material is the second named \"wax\"; write one [[material]] with the keys of both"},
      {after("[[material]]\niso = 0.5\n"), "6: material has no name"},
      {after("[[material]]\nname = \"none\"\n"), "7: material.name = \"none\" is air"},
      {phantom("solid = false"), " no [[volume]] is solid"},
      {phantom("spacing_mm = 0.2"), "3: volume.spacing_mm = 0.2 is given with the phantom"},
      {phantom("size = [64, 64.5, 64]"), "3: volume.size = [64, 64.5, 64] counts voxels"},
      {phantom("pose = { orientation = [0, 0, 0, 0.5] }"),
       "3: volume.pose.orientation = [0, 0, 0, 0.5] has length 0.5"},
      {with("\"phantom\"", "\"a.nrrd\"\nsize = [64, 64, 64]"),
       "3: volume.size = [64, 64, 64] only shapes the phantom"},
      {with("\"phantom\"", "\"a.nrrd\"\nshape = \"wall\""),
       "3: volume.shape = \"wall\" only shapes the phantom"},
      {with("\"phantom\"", "\"a.nrrd\"\nwindow = [5, 5]"), "3: volume.window = [5, 5] is empty"},
      // Shaft and handpiece.
      {after(shaft + "handpiece_radius_mm = 0.5\n"), ""},
      {after("shaft_radius_mm = 0.5\n"),
       "6: tool.shaft_radius_mm = 0.5 has no length; write shaft_length_mm, from the tool's tip to "
       "the shaft's end"},
      {after("shaft_length_mm = 9\n"),
       "6: tool.shaft_length_mm = 9 has no radius; write shaft_radius_mm"},
      {after("handpiece_radius_mm = 5\n"),
       "6: tool.handpiece_radius_mm = 5 has no shaft to hold; write shaft_radius_mm"},
      {after(shaft + "handpiece_length_mm = 5\n"),
       "8: tool.handpiece_length_mm = 5 has no radius; write"},
      {after(shaft + "handpiece_radius_mm = 0.4\n"),
       "8: tool.handpiece_radius_mm = 0.4 is narrower than the shaft; use at least 0.5"},
      {after(shaft + "[force]\nmodel = \"paper\"\n"),
       "7: tool.shaft_length_mm = 9 has contact only with the proxy; set force.model = \"proxy\", "
       "or "
       "leave the shaft out"},
  });
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
    const std::string error = error_of(after(broken));
    CHECK(begins(error, "scenes/x.toml:"));
    CHECK(error.find('\n') == std::string::npos);
    CHECK(error.ends_with(way_out));
  }
  CHECK(begins(error_of(after("[servo\n")), "scenes/x.toml:6:7: "));
  for (const char* doubled : {"a = 1\na = 2\n", "[a]\n[a]\n"}) {
    CHECK(error_of(after(doubled)).find(" existing ") != std::string::npos);
    CHECK(error_of(after(doubled)).ends_with("; leave one of the two out"));
  }
  CHECK(error_of(after("[device]\npersonality = omni\n")).ends_with("; text stands in quotes"));
}

TEST_CASE("control characters never reach a message or a name") {
  const std::string error = error_of(with("\"phantom\"", "\"a\\nb\\u001b[31m\""));
  CHECK(begins(error, "scenes/x.toml:2: volume.file = "));
  CHECK(error.find_first_of("\n\x1b") == std::string::npos);
}

TEST_CASE("a scene file that is not there, no file or a huge one is refused") {
  const TemporaryFolder folder;
  const auto huge = folder.write("huge.toml", std::string((1 << 20) + 1, '#'));
  const auto loop = huge.parent_path() / "loop.toml";
  std::filesystem::create_symlink("loop.toml", loop);
  for (const auto& [path, why] : std::vector<std::pair<std::filesystem::path, std::string>>{
           {"/nowhere/x.toml", ": no such scene file"},
           {huge, "larger than 1 MiB"},
           {loop, ": cannot be reached (Too many levels of symbolic links); "},
           {"/proc/self/mem",
            ": cannot be read; copy it again, or check its disk"},  // as a disk that fails
           {huge.parent_path(), ": is no regular file; "},
           {"/dev/null", ": is no regular file; "}}) {
    const std::string error = test::error_of([&] { static_cast<void>(parse_scene_file(path)); });
    CAPTURE(error);
    CHECK(begins(error, path.string()));
    CHECK(has(error, why));
  }
}

TEST_CASE("a hand script that is not there is refused where one asks") {
  const TemporaryFolder folder;
  const auto file = folder.write("x.toml", kSmallest + "[hand]\nscript = \"hand.toml\"\n");
  const SceneSpec scene = parse_scene_file(file);
  const auto error = [](const SceneSpec& of) {
    return test::error_of([&] { check_hand_script(of); });
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
  const ToolSpec round = tool_of("bur = \"001 014\"\n");
  CHECK(round.name == "round 014");
  CHECK(round.shape == "ball");
  CHECK(round.size.radius_mm == doctest::Approx(0.7));
  CHECK(*round.shaft.radius_mm == doctest::Approx(0.42));
  CHECK(*round.shaft.length_mm == 8);
  CHECK(*tool_of("bur = \"010 050\"\n").shaft.radius_mm == 0.8);  // no thicker than the shank
  const ToolSpec own =
      tool_of("bur = \"107 012\"\nname = \"mine\"\nlength_mm = 5\nshaft_length_mm = 11\n");
  CHECK(own.name == "mine");
  CHECK(*own.size.length_mm == 5);
  CHECK(*own.shaft.length_mm == 11);

  const std::string volume = "[[volume]]\nfile = \"phantom\"\n[[tool]]\n";
  for (const std::string unknown : {"002 014", "001 004", "001 051", "249 032", "001014", "001 01",
                                    "001 0140", "001 -14", "ball"}) {
    check_lines({{volume + "bur = \"" + unknown + "\"\n",
                  "4: tool.bur = \"" + unknown +
                      "\" is no bur; write its head and its diameter in tenths of a mm, such as"}});
  }
  for (const std::string also :
       {"shape = \"ball\"", "radius_mm = 1", "size_vox = 16", "file = \"a.stl\""}) {
    check_lines(
        {{volume + "bur = \"001 014\"\n" + also + "\n", "4: tool.bur = \"001 014\" contradicts"}});
  }
  check_lines({{volume + "bur = \"001 014\"\nlength_mm = 3\n",
                "5: tool.length_mm = 3 contradicts the ball"}});
  const KeyOverride setting{"tool.bur", "\"001 999\""};
  CHECK(
      begins(test::error_of([&] {
               static_cast<void>(parse_scene(volume, "scenes/x.toml", scene_keys(), {&setting, 1}));
             }),
             "scenes/x.toml: --set tool.bur = \"001 999\" is no bur;"));
}

TEST_CASE("a file that an option names stands in no line, and its place says so") {
  const auto scene = [](std::span<const KeyOverride> settings) {
    return parse_scene("[[volume]]\nfile = \"phantom\"\n[[tool]]\nbur = \"001 014\"\n",
                       "scenes/x.toml", scene_keys(), settings);
  };
  const KeyOverride setting{"volume.file", "\"/x.nrrd\""};
  CHECK(scene({}).volumes[0].where == "scenes/x.toml:2");
  CHECK(scene({&setting, 1}).volumes[0].where == "scenes/x.toml: --set");
}

namespace {

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// One to eight bytes changed, removed, doubled or added; or the end cut off.
std::string mutated(std::string text) {
  const int changes = in_range(1, 9);
  for (int i = 0; i < changes && !text.empty(); ++i) {
    const std::size_t at = in_range<std::size_t>(0, text.size());
    const std::string marks = "[]{}=.,\"'\n#-+_e0123456789";
    const char byte = any<bool>() ? any<char>() : marks[in_range<std::size_t>(0, marks.size())];
    switch (in_range(0, 5)) {
      case 0:
        text[at] = byte;
        break;
      case 1:
        text.erase(at, 1);
        break;
      case 2:
        text.insert(at, 1, byte);
        break;
      case 3:
        text.insert(at, text.substr(at, in_range<std::size_t>(1, 40)));
        break;
      default:
        if (i == 0) text.resize(at);
    }
  }
  return text;
}

/// Either a result or a LoadError with one line; anything else escapes and fails the test.
template <class Action>
void must_work_or_explain(Action&& action) {
  const std::string error = test::error_of<LoadError>(action);
  HOLDS(error.find('\n') == std::string::npos);
  HOLDS(error.size() < 500);
}

}  // namespace

TEST_CASE("a damaged scene file is explained or still a scene, never a crash") {
  const std::string scene = contents(std::filesystem::path(KERF_SCENES_DIR) / "two_teeth.toml");
  REQUIRE_FALSE(scene.empty());
  CHECK(property([&] {
    for (int i = 0; i < 20; ++i) {
      const std::string text = mutated(scene);
      must_work_or_explain([&] { static_cast<void>(parse_scene(text, "x.toml")); });
    }
  }));
}

TEST_CASE("a damaged scene file is loaded whole or explained") {
  const TemporaryFolder folder;
  const VoxelGrid grid{12, 12, 12};
  static_cast<void>(folder.write(
      "a.nrrd", nrrd(grid, {0.5, 0.5, 0.5}, block(grid, {{3, 3, 3}, {9, 9, 9}}, 700))));
  const std::string scene =
      "[[volume]]\nfile=\"a.nrrd\"\noverride_spacing_mm=[0.5,0.4,0.3]\nwindow=[0,900]\niso=0.4\n"
      "pose={position_mm=[1,2,3]}\n[[tool]]\nshape=\"flame\"\nradius_mm=0.6\nlength_mm=2.5\n"
      "[device]\nworkspace_scale=2\n[limits]\nforce_n=2.5\n[servo]\nrate_hz=2000\n";
  LoadedScene valid = load_scene(folder.write("valid.toml", scene));
  REQUIRE_FALSE(valid.tools.at(0).offsets.empty());
  CHECK(property([&] {
    const auto path = folder.write("damaged.toml", mutated(scene));
    must_work_or_explain([&] { static_cast<void>(load_scene(path)); });
  }));
}

}  // namespace kerf::scene_file_test
