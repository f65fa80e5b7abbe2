// SPDX-License-Identifier: Apache-2.0
// What load time makes of each shipped scene, to the bit, against loads.txt.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "shared/text/text.hpp"
#include "tests/replay/load_hash.hpp"

namespace kerf::load_test {

using namespace kerf::test;

namespace {

/// By scene. Scenes of files are left out if they cannot be read: the data of some do not come with
/// kerf, and another processor reads no file.
std::map<std::string, std::string> loaded_scenes() {
  std::map<std::string, std::string> hashes;
  for (const auto& file : std::filesystem::directory_iterator(KERF_SCENES)) {
    if (file.path().extension() != ".toml") continue;
    try {
      const LoadedScene scene = load_scene(file.path().string(), {});
      hashes[file.path().stem().string()] = hex64(load_hash(scene));
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

}  // namespace kerf::load_test
