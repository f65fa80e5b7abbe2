// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/tool/scene_tool.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/volume_noise.hpp"

namespace kerf {

/// Position in mm and orientation as a quaternion x, y, z, w of unit length.
struct Pose {
  std::array<double, 3> position_mm{0, 0, 0};
  std::array<double, 4> orientation{0, 0, 0, 1};
};

/// One [[volume]] after loading, windowing and cropping. `pose` takes volume-frame mm (voxel
/// (0,0,0) at the origin, axes along the voxel axes) to world.
struct SceneVolume {
  std::string name;
  std::string file;
  VolumeImage image;
  Pose pose;
  Density iso = 32768;
  bool solid = true;
  Noise noise;                          ///< that was found
  int denoised = 0;                     ///< passes that were made against it
  std::vector<std::string> proposal{};  ///< of --volume: "what=chosen" for each choice
  std::vector<Material> proposed{};     ///< the materials that belong to it
  bool enclosed = false;  ///< not cropped, solid at its border: a layer of air was laid around it
};

/// A scene after loading: everything the controller needs, in double, checked. Load time only.
struct LoadedScene : SceneSettings {
  std::vector<SceneVolume> volumes;
  std::vector<SceneTool> tools;
  std::size_t active_tool = 0;
  std::vector<VolumeSpec> volume_specs;  ///< as the file and the command line say them
  std::vector<ToolSpec> tool_specs;      ///< the same, with the sizes in effect
};

}  // namespace kerf
