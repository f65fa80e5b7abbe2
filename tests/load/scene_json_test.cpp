// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_json.hpp"

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include "controller/scene/materials.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "tests/scene/support.hpp"

namespace {

using nlohmann::json;

kerf::LoadedScene small_scene() {
  kerf::LoadedScene scene;
  scene.path = "/somewhere/scene.toml";
  scene.materials = kerf::default_materials();
  kerf::SceneVolume volume;
  volume.name = "block";
  volume.file = "block.nrrd";
  volume.image.grid = {4, 5, 6};
  volume.image.spacing_mm = {0.1, 0.2, 1.0 / 3};
  volume.image.density = kerf::test::block({4, 5, 6}, {{1, 1, 1}, {3, 3, 3}}, 50000);
  volume.iso = 30000;
  volume.pose.position_mm = {1, 2, 3};
  scene.volumes.push_back(volume);
  scene.tools.push_back(kerf::make_tool("bur", "ball", {.size_vox = 4}));
  scene.tools.push_back(kerf::make_tool("disc", "wheel", {.pitch_mm = 0.1, .radius_mm = 0.5}));
  scene.active_tool = 1;
  scene.device.torque_scale = {0.342, 0.342, 0.342};
  return scene;
}

}  // namespace

TEST_CASE("the scene's JSON holds what a reader of the segment needs") {
  const json root = json::parse(kerf::canonical_json(small_scene()));
  const json& volume = root.at("volumes").at(0);
  CHECK(volume.at("name") == "block");
  CHECK(volume.at("file") == "block.nrrd");
  CHECK(volume.at("iso") == 30000);
  CHECK(volume.at("solid") == true);
  CHECK(volume.at("grid") == json({4, 5, 6}));
  CHECK(volume.at("spacing_mm").at(2).get<double>() == 1.0 / 3);
  CHECK(volume.at("pose").at("position_mm") == json({1.0, 2.0, 3.0}));
  CHECK(volume.at("pose").at("orientation") == json({0.0, 0.0, 0.0, 1.0}));

  const kerf::LoadedScene scene = small_scene();
  const json& tool = root.at("tools").at(0);
  CHECK(tool.at("round") == true);
  CHECK(tool.at("turns") == true);
  CHECK(tool.at("size_vox") == json({4, 4, 4}));
  REQUIRE(tool.at("offsets_half_pitch").size() == 3 * scene.tools[0].offsets.size());
  CHECK(tool.at("offsets_half_pitch").at(0) == scene.tools[0].offsets[0][0]);
  CHECK(tool.at("offsets_half_pitch").at(5) == scene.tools[0].offsets[1][2]);
  CHECK(tool.at("profile").front() == json({-0.25, 0.0}));
  CHECK(tool.at("profile").at(16).size() == 2);
  CHECK(root.at("tools").at(1).at("shape") == "wheel");
  CHECK(root.at("active_tool") == 1);
  CHECK(root.at("materials").at(1).at("name") == "enamel");
  CHECK(root.at("materials").at(1).at("colour").size() == 3);
  CHECK(root.at("device").at("torque_scale").at(0) == 0.342);
  CHECK(root.at("force").at("model") == "proxy");
  CHECK(root.at("cut").at("model") == "preston");
  CHECK(root.at("limits").at("force_n") == 3.3);
  CHECK(root.at("servo").at("numeric") == "fixed");
  CHECK(root.at("servo").at("kernel") == "farid");
}

TEST_CASE("the JSON is canonical: one line, sorted keys, and the same after a round trip") {
  const std::string text = kerf::canonical_json(small_scene());
  CHECK(text == kerf::canonical_json(small_scene()));
  CHECK(text.find('\n') == std::string::npos);
  CHECK(json::parse(text).dump() == text);  // nlohmann sorts keys on parsing
  CHECK(text.rfind("{\"active_tool\":1,\"cut\":{\"friction\":", 0) == 0);
}

TEST_CASE("a title is told, and changes nothing for the scenes without one") {
  kerf::LoadedScene scene = small_scene();
  CHECK_FALSE(json::parse(kerf::canonical_json(scene)).contains("scene"));
  scene.title = "a block";
  CHECK(json::parse(kerf::canonical_json(scene)).at("scene").at("title") == "a block");
}

TEST_CASE("where a scene lies does not change its identity, anything in it does") {
  const std::string text = kerf::canonical_json(small_scene());
  kerf::LoadedScene moved = small_scene();
  moved.path = "/elsewhere/scene.toml";
  CHECK(kerf::canonical_json(moved) == text);

  const std::vector<std::function<void(kerf::LoadedScene&)>> changes = {
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
      [](auto& s) { s.cut.model = kerf::CutModel::none; },
      [](auto& s) { s.limits.slew_n_per_ms = 0.4; },
      [](auto& s) { s.servo.rate_hz = 2000; },
      [](auto& s) { s.servo.numeric = kerf::NumericKind::float32; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    CAPTURE(i);
    kerf::LoadedScene changed = small_scene();
    changes[i](changed);
    CHECK(kerf::canonical_json(changed) != text);
  }
}

TEST_CASE("the hash is FNV-1a") {
  CHECK(kerf::fnv1a("") == 0xcbf29ce484222325);
  CHECK(kerf::fnv1a("a") == 0xaf63dc4c8601ec8c);
  CHECK(kerf::fnv1a("foobar") == 0x85944171f73967e8);
}

TEST_CASE("a path that is not UTF-8 does not break the JSON") {
  kerf::LoadedScene scene = small_scene();
  scene.volumes[0].file = "caf\xe9.nrrd";
  CHECK(json::parse(kerf::canonical_json(scene)).at("volumes").at(0).at("file") ==
        "caf\uFFFD.nrrd");
}
