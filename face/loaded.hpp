// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "include/kerf/scene.hpp"

// What a `Scene` of other programs holds, and the one exception that they see.

namespace kerf {

struct Scene::Loaded {
  LoadedScene scene;  ///< with its densities, which each servo copies
  std::string json;   ///< `canonical_json`
  std::uint64_t config_hash = 0;
  SceneSource source;
};

/// Does `work`; what it throws becomes an `Error` with the same line.
template <class Work>
auto or_error(const Work& work) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(error.what());
  }
}

}  // namespace kerf
