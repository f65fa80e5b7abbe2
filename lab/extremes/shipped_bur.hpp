// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/load/loaded_scene.hpp"

namespace kerf::extremes {

/// The fluted bur of scenes/fluted_bur.toml in voxels of 0.125 mm: 32 units long, 6.4 in radius.
/// Throws HilError where its file cannot be read.
[[nodiscard]] SceneTool shipped_bur();

}  // namespace kerf::extremes
