// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/scene/scene_table.hpp"

namespace kerf {

// What no single row of the table of keys can say: rules between keys, and values that follow from
// others. `table` has been read into the value beside it. Each throws SceneError. Used by the
// parser of scene files alone.

void finish_volume(const SceneTable& table, VolumeSpec& volume);
void finish_tool(const SceneTable& table, ToolSpec& tool);
/// The material of that name: one of the list, or a new one at its end with what is known of it.
[[nodiscard]] Material& material_named(const SceneTable& table, const std::string& name,
                                       std::vector<Material>& materials);

void finish_device(const SceneTable& table, Scene& scene);
/// The paper's force knows no normal that could cut by force: unless its scene says another model
/// of cutting, it comes with the paper's own.
void choose_cut(const SceneTable& table, Scene& scene);
/// The overlap models cut whatever they meet, forbidden or not.
void refuse_uncut(const Scene& scene);
/// The paper's force feels heads alone.
void refuse_unfelt(const Scene& scene);
/// A law stands in place of the coupling, whose own keys then count for nothing.
void refuse_idle_coupling(const SceneTable& table, const ForceSettings& force);

void finish_limits(const SceneTable& table, LimitSettings& limits);

}  // namespace kerf
