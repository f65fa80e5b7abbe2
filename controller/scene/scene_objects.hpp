// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_table.hpp"

namespace kerf {

// What stands in a scene several times: [[volume]], [[tool]] and [[material]]. Used by the parser
// of scene files alone; each function checks one table and throws SceneError.

inline constexpr std::string_view kVolumeKeys[] = {"name", "file", "size", "spacing_mm", "window",
                                                   "iso",  "crop", "pose", "solid"};
inline constexpr std::string_view kToolKeys[] = {
    "name", "shape", "radius_mm", "size_vox", "length_mm", "file", "scale", "pitch_mm", "turns"};
inline constexpr std::string_view kMaterialKeys[] = {"name",          "iso",       "felt_iso",
                                                     "machinability", "forbidden", "colour"};

[[nodiscard]] VolumeSpec read_volume_table(const SceneTable& table);
[[nodiscard]] ToolSpec read_tool_table(const SceneTable& table);
/// A name of the table changes that material, another one is added with what is known of it.
void read_material_table(const SceneTable& table, std::vector<Material>& materials);

}  // namespace kerf
