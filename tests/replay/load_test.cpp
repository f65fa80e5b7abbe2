// SPDX-License-Identifier: Apache-2.0
// What load time makes of each shipped scene, to the bit: the volumes' content and all samples of
// the tools. It is computed in double, by operations that IEEE 754 fixes and elementary.hpp, so
// that processor, compiler and C library change nothing. The rest of a plan are fixed-point numbers
// of these and of the scene's settings, which the golden and the recorded runs step on.
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/air_speed.hpp"
#include "controller/plan/compile.hpp"
#include "controller/tool/surface_samples.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/text/text.hpp"

using namespace kerf;

namespace {

class Hash {
 public:
  void add(std::uint64_t word) { hash_ = fnv1a_step(hash_, word); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const std::array<double, 3>& v) {
    for (const double x : v) add(x);
  }
  void add(const PartSamples& part) {
    for (const auto& at : part.samples) add(at);
    for (const SurfaceSample& sample : part.close) {
      add(sample.at);
      add(sample.normal);
    }
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = kFnv1aBasis;
};

std::uint64_t hash_of(LoadedScene& scene) {
  Hash hash;
  for (const SceneVolume& volume : scene.volumes) {
    for (const Density density : volume.image.density) hash.add(std::uint64_t{density});
    for (const Label label : volume.image.labels) hash.add(std::uint64_t{label});
    hash.add(std::uint64_t{volume.iso});
  }
  const bool swept = scene.force.model == ForceModel::proxy;
  for (const SceneTool& tool : scene.tools) {
    for (const ToolOffset& offset : tool.offsets) {
      for (const auto half_pitches : offset) hash.add(static_cast<std::uint64_t>(half_pitches));
    }
    if (!swept) continue;
    const double unit_mm = contact_unit_mm(scene);
    hash.add({surface_samples(tool, unit_mm), close_samples(tool, unit_mm)});
    for (const ToolPart& part : shaft_parts(tool)) {
      hash.add(part.middle_mm);
      hash.add(part_samples(tool, part, unit_mm));
    }
  }
  const auto plan = plan_scene(scene);
  for (const double speed : plan->costs().air_speeds_mm_per_s) hash.add(speed);
  return hash.value();
}

/// By scene. Scenes of files are left out if they cannot be read: the data of some do not come with
/// kerf, and another processor reads no file.
std::map<std::string, std::string> loaded_scenes() {
  std::map<std::string, std::string> hashes;
  for (const auto& file : std::filesystem::directory_iterator(KERF_SCENES)) {
    if (file.path().extension() != ".toml") continue;
    try {
      LoadedScene scene = load_scene(file.path().string(), {});
      hashes[file.path().stem().string()] = hex64(hash_of(scene));
    } catch (const LoadError& error) {
      MESSAGE(std::string(error.what()));
    }
  }
  return hashes;
}

}  // namespace

TEST_CASE("load: each shipped scene becomes the same bits on every machine") {
  const std::string path = std::string(KERF_INPUTS) + "/loads.txt";
  const auto found = loaded_scenes();
  if (std::getenv("KERF_WRITE_PAGE") != nullptr) {
    std::ofstream page(path);
    for (const auto& [scene, hash] : found) page << scene << ' ' << hash << '\n';
  }
  std::ifstream file(path);
  std::size_t compared = 0;
  for (std::string scene, hash; file >> scene >> hash;) {
    CAPTURE(scene);
    if (!found.contains(scene)) continue;
    CHECK(found.at(scene) == hash);
    ++compared;
  }
  INFO("renew them: KERF_WRITE_PAGE=1 build/release/bin/test_replay -tc='load:*'");
  CHECK(compared == found.size());  // each has a line
  CHECK(compared >= 14);
}
