// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/methods.hpp"
#include "controller/plan/tables/tick_memory.hpp"
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
  void hold(const ToolCase& in, std::size_t v) {
    if (v == volumes_.size()) {
      volumes_.push_back({in.volume.name, in.volume.image.labels.size(), 0, {}, {}});
    }
    std::size_t& length = volumes_[v].length;
    length = std::max(length, most_listed(in, nullptr));
  }

  /// Allocates; points plan and state at it.
  void take(const LoadedScene& scene, ServoPlan<N>& plan, ForceCutState<N>& state) {
    for (std::size_t v = 0; v < volumes_.size(); ++v) {
      Volume& volume = volumes_[v];
      volume.list.resize(volume.length);
      volume.labels = scene.volumes[plan.volumes[v].scene_index].image.labels;
      state.list[v] = volume.list;
      plan.force_cut.volume[v].labels = volume.labels;
    }
  }

  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    for (const Volume& volume : volumes_) {
      list.push_back({"voxels under the tool in " + volume.name,
                      volume.length * sizeof(CoveredEntry<N>), false});
      if (volume.label_count == 0) continue;
      list.push_back({"materials of " + volume.name, volume.label_count * sizeof(Label), false});
    }
    return list;
  }

 private:
  struct Volume {
    std::string name;
    std::size_t label_count, length;
    std::vector<CoveredEntry<N>> list;
    std::vector<Label> labels;
  };

  std::vector<Volume> volumes_;
};

}  // namespace kerf
