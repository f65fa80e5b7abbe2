// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/load/loaded_scene.hpp"

namespace kerf::extremes {

/// A scene of the search for traps: matter about the device's origin, in voxels of 0.125 mm, and
/// tools of every shape that cut it by force.
struct TrapScene {
  LoadedScene scene;
  std::string what;  ///< matter, numbers and rate, for a person
  int presses = 0;   ///< of about the same work in all scenes
};

/// The scene with this number, the same on every machine. Matter: flat, crown, layers, rubble,
/// pits, shells, plates, and a block that ends at the volume's border; half of it with a soft
/// material, that no cut may touch in half of those. Of 24 scenes in a row 12 run in fixed point at
/// 1 kHz, the others at 250 Hz, at 8 kHz, in double or in float. Half of the tools have a shaft,
/// some a handpiece; one scene of four has the fluted bur of scenes/burs. Throws SceneError where
/// that cannot be read.
[[nodiscard]] TrapScene trap_scene(std::uint64_t number);

/// The same with a flat that is softer than its iso, all of it: 0.2 to 0.97 of that.
[[nodiscard]] TrapScene soft_scene(std::uint64_t number);

}  // namespace kerf::extremes
