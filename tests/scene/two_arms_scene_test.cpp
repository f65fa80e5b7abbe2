// SPDX-License-Identifier: Apache-2.0
// [[device]] and [[hand]] twice: a scene with two arms.
#include <array>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_keys.hpp"
#include "shared/text/json.hpp"
#include "tests/scene/support.hpp"
#include "tests/support/property.hpp"

namespace kerf::two_arms_scene_test {

using namespace kerf::test;

namespace {

// Ten lines, so that what is appended begins on line 11.
const std::string kTools =
    "[[volume]]\n"
    "file = \"phantom\"\n"
    "size = [48, 48, 32]\n"
    "[[tool]]\n"
    "name = \"big\"\n"
    "shape = \"ball\"\n"
    "radius_mm = 2\n"
    "[[tool]]\n"
    "shape = \"ball\"\n"
    "radius_mm = 1\n";
const std::string kTwo = kTools +
                         "[[device]]\n"
                         "personality = \"omni\"\n"
                         "workspace_scale = 2\n"
                         "[[device]]\n"
                         "personality = \"omega\"\n"
                         "torque_scale = [1, 1, 1]\n"
                         "offset_mm = [1, 2, 3]\n";

SceneSpec parse(const std::string& text, const std::vector<std::string>& settings = {}) {
  std::vector<KeyOverride> overrides;
  for (const std::string& setting : settings) overrides.push_back(parse_setting(setting));
  return parse_scene(text, "scenes/x.toml", scene_keys(), overrides);
}

std::string error_of(const std::string& text, const std::vector<std::string>& settings = {}) {
  return test::error_of([&] { static_cast<void>(parse(text, settings)); });
}

LoadedScene load(const std::string& text, const SceneOverrides& overrides = {}) {
  return load_scene("scenes/x.toml", text, overrides);
}

}  // namespace

TEST_CASE("[[device]] once is [device], and twice is two arms") {
  const SceneSpec one =
      parse(kTools + "[[device]]\npersonality = \"touch\"\n[[hand]]\nscript = \"a\"\n");
  CHECK(one.device.personality == Personality::touch);
  CHECK(one.hand_script == "scenes/a");
  CHECK_FALSE(one.second);

  const SceneSpec two = parse(kTwo + "[[hand]]\nscript = \"a\"\n[[hand]]\nscript = \"b\"\n");
  CHECK(two.device.personality == Personality::omni);
  CHECK_FALSE(two.device.torque_scale);
  REQUIRE(two.second);
  CHECK(two.second->device.personality == Personality::omega);
  CHECK(two.second->device.torque_scale == std::array{1.0, 1.0, 1.0});
  CHECK(two.second->device.offset_mm == std::array{1.0, 2.0, 3.0});
  CHECK(two.hand_script == "scenes/a");
  CHECK(two.second->hand_script == "scenes/b");
  CHECK(parse(kTwo).second->hand_script.empty());
}

TEST_CASE("the limits of each arm are those of its own device") {
  const SceneSpec own = parse(kTwo);
  CHECK(own.limits.force_n == 3.3);
  CHECK(own.second->limits.force_n == 12);
  const SceneSpec given = parse(kTwo + "[limits]\nforce_n = 2\ncontinuous_force_n = 0.5\n");
  CHECK(given.limits.force_n == 2);
  CHECK(given.second->limits.force_n == 2);
  CHECK(given.second->limits.slew_n_per_ms == 1.8);
  // Above the peak of one of them.
  CHECK(error_of(kTwo + "[limits]\nforce_n = 4\n") ==
        "scenes/x.toml:19: limits.force_n = 4 is out of range for omni; use 0.01 to 3.3");
}

TEST_CASE("what two arms cannot be is one line with its place") {
  const auto begins = [](const std::string& text, const std::string& head) {
    CAPTURE(text);
    return text.rfind(head, 0) == 0;
  };
  const std::string device = "[[device]]\npersonality = \"omni\"\n";
  CHECK(
      error_of(kTools + device + device + device) ==
      "scenes/x.toml:11: device = [{..}, {..}, {..}] has 3 entries; use at most 2: a scene has two "
      "arms");
  CHECK(
      error_of(kTools + device + "[[hand]]\nscript = \"a\"\n[[hand]]\nscript = \"b\"\n") ==
      "scenes/x.toml:15: hand is of a second device, and there is one; write a second [[device]], "
      "or one [hand]");
  CHECK(error_of(kTwo + "workspace_scale = 2\n") ==
        "scenes/x.toml:18: device.workspace_scale = 2 is the scene's, and both hands have it; "
        "write it "
        "in the first [[device]] alone");
  CHECK(begins(error_of(kTwo + "fit = true\n"),
               "scenes/x.toml:18: device.fit = true is the scene's"));
  CHECK(begins(error_of(kTwo + "personalty = 1\n"),
               "scenes/x.toml:18:1: device.personalty is not a known key; did you mean"));
  CHECK(begins(error_of(kTwo + "dock_rad = [0, 0, 0]\n"), "scenes/x.toml:18: device.dock_rad"));
  CHECK(begins(error_of(kTwo + "first_tool = \"bigg\"\n"),
               "scenes/x.toml:18: device.first_tool = \"bigg\" is unknown"));
  CHECK(has(error_of(kTwo + "first_tool = \"bigg\"\n"), "big"));
  CHECK(begins(error_of(kTools + "[[device]]\nfirst_tool = \"\"\n"), "scenes/x.toml:12:"));
  CHECK(begins(error_of("device = []\n" + kTools), "scenes/x.toml:1: device = [] is not a table"));
  CHECK(begins(error_of("device = [1, 2]\n" + kTools), "scenes/x.toml:1: device = "));
  CHECK(begins(error_of("device = [{}, 2]\n" + kTools), "scenes/x.toml:1: device = "));
}

TEST_CASE("a setting of a command line is for both devices, but the scale, which they share") {
  const SceneSpec scene = parse(kTwo, {"device.personality=touch", "device.workspace_scale=3"});
  CHECK(scene.device.personality == Personality::touch);
  CHECK(scene.second->device.personality == Personality::touch);
  CHECK(scene.device.workspace_scale == 3);
  CHECK(has(settings_text(scene), "device.personality=\"touch\"\n"));
}

TEST_CASE("loaded, the second arm has the scale of the first and a tool of its own") {
  const LoadedScene scene = load(kTwo);
  CHECK(arms_of(scene) == 2);
  CHECK(scene.second->device.workspace_scale == 2);
  CHECK(scene.active_tool == 0);
  CHECK(scene.second_tool == 1);
  CHECK(scene.second->device.offset_mm == std::array{1.0, 2.0, 3.0});
  const LoadedScene named = load(kTwo + "first_tool = \"big\"\n");
  CHECK(named.second_tool == 0);
  // Without an offset both origins lie over the first surface.
  const LoadedScene none = load(kTools + "[[device]]\n[[device]]\n");
  CHECK(none.second->device.offset_mm == none.device.offset_mm);

  // A volume of the command line has its own surface and scale: the hands stay as far apart.
  const std::string apart =
      kTools + "[[device]]\noffset_mm = [-2, 5, 0]\n[[device]]\noffset_mm = [4, 6, 0]\n";
  const LoadedScene other = load(apart, {.volume_file = "phantom"});
  const double scale = other.device.workspace_scale;
  CHECK(scale != 1);
  CHECK(other.device.offset_mm[0] != -2);
  CHECK(other.second->device.offset_mm[0] - other.device.offset_mm[0] ==
        doctest::Approx(6 * scale));
  CHECK(other.second->device.offset_mm[1] - other.device.offset_mm[1] == doctest::Approx(scale));

  const LoadedScene second = second_arm_of(scene);
  CHECK_FALSE(second.second);
  CHECK(second.active_tool == 1);
  CHECK(second.device.personality == Personality::omega);
  CHECK(second.limits.force_n == 12);
}

TEST_CASE("options name both devices: one scale for both, or six numbers") {
  SceneOverrides overrides;
  overrides.torque_scale = std::array{0.5, 0.5, 0.5};
  // A motor's scale of one device is none of another's.
  CHECK(test::error_of([&] { static_cast<void>(load(kTwo, overrides)); }) ==
        "--torque-scale has three numbers, and the scene has two devices of different kinds; give "
        "six");
  CHECK(error_of(kTwo, {"device.torque_scale=[1,1,1]"}) ==
        "--set device.torque_scale: the scene has two devices of different kinds; write each one's "
        "in "
        "its [[device]]");
  overrides.personality = Personality::touch;
  const LoadedScene both = load(kTwo, overrides);
  CHECK(both.device.torque_scale == overrides.torque_scale);
  CHECK(both.second->device.torque_scale == overrides.torque_scale);
  overrides.personality.reset();
  overrides.second_torque_scale = std::array{2.0, 2.0, 2.0};
  const LoadedScene each = load(kTwo, overrides);
  CHECK(each.device.torque_scale == overrides.torque_scale);
  CHECK(each.second->device.torque_scale == overrides.second_torque_scale);
  CHECK(test::error_of([&] { static_cast<void>(load(kTools, overrides)); }) ==
        "--torque-scale has six numbers, and the scene has one [device]; give three");
}

TEST_CASE("the JSON of a scene has the second arm, and that of one arm has nothing new") {
  const Json two = Json::parse(canonical_json(load(kTwo)));
  CHECK(two.at("device").at("personality").get<std::string>() == "omni");
  CHECK(two.at("second_device").at("personality").get<std::string>() == "omega");
  CHECK(two.at("second_device").at("workspace_scale").get<double>() == 2);
  CHECK(two.at("second_limits").at("force_n").get<double>() == 12);
  CHECK(two.at("second_tool").get<int>() == 1);
  CHECK_FALSE(has(canonical_json(load(kTools)), "second"));
}

}  // namespace kerf::two_arms_scene_test
