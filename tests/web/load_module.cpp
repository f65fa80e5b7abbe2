// SPDX-License-Identifier: Apache-2.0
// What load time makes of a scene in WebAssembly: a module with the memory of web/exports.cpp, and
// `load_hash` of tests/replay, for load_test.js.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "shared/text/text.hpp"
#include "tests/replay/load_hash.hpp"

namespace {

std::vector<std::byte> buffer;

}  // namespace

#define KERF_EXPORT(name) extern "C" [[clang::export_name(#name)]]

KERF_EXPORT(room) std::byte* room(std::size_t bytes) {
  if (bytes > buffer.size()) buffer.resize(bytes);
  return buffer.data();
}

/// The buffer has the name of a scene, a zero, and its text. Leaves the hash there, as 16 hex
/// digits. A scene of files ends the instance with its line.
KERF_EXPORT(load_hash) std::size_t load_hash(std::size_t bytes) {
  const std::string all(reinterpret_cast<const char*>(buffer.data()), bytes);
  const std::string name = all.substr(0, all.find('\0'));
  const kerf::LoadedScene scene =
      kerf::load_scene(kerf::SceneSource{name, all.substr(name.size() + 1), {}});
  const std::string hash = kerf::hex64(kerf::test::load_hash(scene));
  std::memcpy(buffer.data(), hash.data(), hash.size());
  return hash.size();
}
