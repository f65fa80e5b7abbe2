// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/covered_bound.hpp"
#include "controller/plan/planned_array.hpp"
#include "controller/plan/scene_costs.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// Owner of what cutting by force needs of each volume of the plan: the list of voxels under the
/// tool, and the labels, which the scene keeps for the eyes alone. Empty in other models. Load
/// time.
template <class N>
class ForceCutMemory {
 public:
  /// What a tool needs in volume `v` of the plan, the next one or one that is known.
  void hold(const SceneTool& tool, const SceneVolume& volume, std::size_t v) {
    if (v == volumes_.size()) volumes_.push_back({volume.name, volume.image.labels.size(), {}, {}});
    volumes_[v].list.need(N::kIsFixed ? most_groups(tool, volume) : most_covered(tool, volume));
  }

  /// Allocates; points plan and state at it.
  void take(const LoadedScene& scene, ServoPlan<N>& plan, ForceCutState<N>& state) {
    for (std::size_t v = 0; v < volumes_.size(); ++v) {
      Volume& volume = volumes_[v];
      volume.list.allocate();
      volume.labels = scene.volumes[plan.volumes[v].scene_index].image.labels;
      state.list[v] = volume.list.span();
      plan.force_cut.volume[v].labels = volume.labels;
    }
  }

  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    for (const Volume& volume : volumes_) {
      list.push_back({"voxels under the tool in " + volume.name, volume.list.bytes(), false});
      if (volume.label_count == 0) continue;
      list.push_back({"materials of " + volume.name, volume.label_count * sizeof(Label), false});
    }
    return list;
  }

 private:
  struct Volume {
    std::string name;
    std::size_t label_count;
    PlannedArray<CoveredEntry<N>> list;
    std::vector<Label> labels;
  };

  std::vector<Volume> volumes_;
};

}  // namespace kerf
