// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_json.hpp"

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "tests/json.hpp"
#include "tests/scene/support.hpp"

namespace kerf::scene_json_test {

using namespace kerf::test;

namespace {

using List = Json::List;

LoadedScene small_scene() {
  LoadedScene scene;
  scene.path = "/somewhere/scene.toml";
  scene.materials = default_materials();
  SceneVolume volume;
  volume.name = "block";
  volume.file = "block.nrrd";
  volume.image.grid = {4, 5, 6};
  volume.image.spacing_mm = {0.1, 0.2, 1.0 / 3};
  volume.image.density = block({4, 5, 6}, {{1, 1, 1}, {3, 3, 3}}, 50000);
  volume.iso = 30000;
  volume.pose.position_mm = {1, 2, 3};
  scene.volumes.push_back(volume);
  scene.tools.push_back(make_tool("bur", "ball", {.size_vox = 4}));
  scene.tools.push_back(make_tool("disc", "wheel", {.pitch_mm = 0.1, .radius_mm = 0.5}));
  scene.active_tool = 1;
  scene.device.torque_scale = {0.342, 0.342, 0.342};
  return scene;
}

}  // namespace

TEST_CASE("the scene's JSON holds what a reader of the segment needs") {
  const ReadJson root = read_json(canonical_json(small_scene()));
  const ReadJson volume = root["volumes"][0];
  CHECK(volume["name"] == "block");
  CHECK(volume["file"] == "block.nrrd");
  CHECK(volume["iso"] == 30000);
  CHECK(volume["solid"] == true);
  CHECK(volume["grid"] == ReadJson(List{4, 5, 6}));
  CHECK(volume["spacing_mm"][2].get<double>() == 1.0 / 3);
  CHECK(volume["pose"]["position_mm"] == ReadJson(List{1.0, 2.0, 3.0}));
  CHECK(volume["pose"]["orientation"] == ReadJson(List{0.0, 0.0, 0.0, 1.0}));

  const LoadedScene scene = small_scene();
  const ReadJson tool = root["tools"][0];
  CHECK(tool["round"] == true);
  CHECK(tool["turns"] == true);
  CHECK(tool["size_vox"] == ReadJson(List{4, 4, 4}));
  REQUIRE(tool["offsets_half_pitch"].size() == 3 * scene.tools[0].offsets.size());
  CHECK(tool["offsets_half_pitch"][0] == scene.tools[0].offsets[0][0]);
  CHECK(tool["offsets_half_pitch"][5] == scene.tools[0].offsets[1][2]);
  CHECK(tool["profile"][0] == ReadJson(List{-0.25, 0.0}));
  CHECK(tool["profile"][16].size() == 2);
  CHECK(root["tools"][1]["shape"] == "wheel");
  CHECK(root["active_tool"] == 1);
  CHECK(root["materials"][1]["name"] == "enamel");
  CHECK(root["materials"][1]["colour"].size() == 3);
  CHECK(root["device"]["torque_scale"][0] == 0.342);
  CHECK(root["force"]["model"] == "proxy");
  CHECK(root["cut"]["model"] == "preston");
  CHECK(root["limits"]["force_n"] == 3.3);
  CHECK(root["servo"]["numeric"] == "fixed");
  CHECK(root["servo"]["kernel"] == "farid");
}

TEST_CASE("the JSON is canonical: one line, sorted keys, and the same after a round trip") {
  const std::string text = canonical_json(small_scene());
  CHECK(text == canonical_json(small_scene()));
  CHECK(text.find('\n') == std::string::npos);
  CHECK(read_json(text).canonical() == text);
  CHECK(std::ranges::is_sorted(read_json(text).members(), {}, &Json::Member::key));
  CHECK(text.rfind("{\"active_tool\":1,\"cut\":{\"friction\":", 0) == 0);
}

TEST_CASE("a title is told, and changes nothing for the scenes without one") {
  LoadedScene scene = small_scene();
  CHECK_FALSE(read_json(canonical_json(scene)).contains("scene"));
  scene.title = "a block";
  CHECK(read_json(canonical_json(scene))["scene"]["title"] == "a block");
}

TEST_CASE("where a scene lies does not change its identity, anything in it does") {
  const std::string text = canonical_json(small_scene());
  LoadedScene moved = small_scene();
  moved.path = "/elsewhere/scene.toml";
  CHECK(canonical_json(moved) == text);

  const std::vector<std::function<void(LoadedScene&)>> changes = {
      [](auto& s) { ++s.volumes[0].image.density[7]; },
      [](auto& s) { s.volumes[0].image.density[7] = 256; },
      [](auto& s) { s.volumes[0].image.labels.assign(120, 1); },
      [](auto& s) { ++s.volumes[0].iso; },
      [](auto& s) { s.volumes[0].solid = false; },
      [](auto& s) { s.volumes[0].pose.position_mm[1] += 1e-9; },
      [](auto& s) { s.tools[0].offsets.pop_back(); },
      [](auto& s) { s.tools[1].name = "other"; },
      [](auto& s) { s.active_tool = 0; },
      [](auto& s) { s.materials[1].machinability = 2; },
      [](auto& s) { s.device.torque_scale.reset(); },
      [](auto& s) { s.device.dock_rad[1] = 0.2; },
      [](auto& s) { s.force.stiffness_n_per_mm = 0.3; },
      [](auto& s) { s.cut.model = CutModel::none; },
      [](auto& s) { s.limits.slew_n_per_ms = 0.4; },
      [](auto& s) { s.servo.rate_hz = 2000; },
      [](auto& s) { s.servo.numeric = NumericKind::float64; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    CAPTURE(i);
    LoadedScene changed = small_scene();
    changes[i](changed);
    CHECK(canonical_json(changed) != text);
  }
}

TEST_CASE("the hash is FNV-1a") {
  CHECK(fnv1a("") == 0xcbf29ce484222325);
  CHECK(fnv1a("a") == 0xaf63dc4c8601ec8c);
  CHECK(fnv1a("foobar") == 0x85944171f73967e8);
}

TEST_CASE("a path that is not UTF-8 does not break the JSON") {
  LoadedScene scene = small_scene();
  scene.volumes[0].file = "caf\xe9.nrrd";
  CHECK(read_json(canonical_json(scene))["volumes"][0]["file"] == "caf\uFFFD.nrrd");
}

}  // namespace kerf::scene_json_test
