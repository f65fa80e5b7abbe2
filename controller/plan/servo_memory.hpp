// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/aligned_tool.hpp"
#include "controller/plan/contact_memory.hpp"
#include "controller/plan/force_cut_memory.hpp"
#include "controller/plan/lattice.hpp"
#include "controller/plan/planned_array.hpp"
#include "controller/plan/sample_tool.hpp"
#include "controller/plan/scene_costs.hpp"
#include "controller/plan/tick_memory.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// Owner of all arrays that a compiled scene steps on. First the `hold` functions, one a plan, say
/// what a tool needs; then `take` makes the memory. What nobody needs does not exist. Load time.
template <class N>
class ServoMemory {
 public:
  explicit ServoMemory(const LoadedScene& scene)
      : cutting_(scene.cut.model != CutModel::none),
        by_force_(scene.cut.model == CutModel::preston) {
    for (const SceneVolume& volume : scene.volumes) {
      volumes_.push_back({volume.name, volume.image.density.size() * sizeof(Density),
                          volume.image.labels.size() * sizeof(Label)});
      if (volume.solid) solid_names_.push_back(volume.name);
    }
  }

  /// The samples of the next tool; they stay where they are.
  std::span<const ToolOffset> hold_samples(const SceneTool& tool) {
    return samples_.emplace_back(tool.name, tool.offsets).second;
  }

  [[nodiscard]] ContactMemory<N>& contact() noexcept { return contact_; }
  [[nodiscard]] ForceCutMemory<N>& force_cut() noexcept { return force_cut_; }

  /// A table of the plan `aligned`; it stays where it is.
  const AlignedTable& hold_table(const SceneTool& tool, const LatticeTurn& turn,
                                 GradientKernel kernel, const KernelSet& kernels) {
    tables_.emplace_back(tool.name, std::make_unique<AlignedTool>(turned(tool.offsets, turn),
                                                                  exact_taps(kernel), kernels));
    return tables_.back().second->table();
  }

  /// What a tool needs in volume `v` of the plan, in the plan `aligned`.
  void hold_aligned(std::size_t v, const AlignedTable& table) {
    scratch_.tick().hold(table.size, cutting_);
    if (cutting_ && !by_force_) carries_[v].need(static_cast<std::size_t>(table.row_lanes));
  }

  /// The same in the plan `gather`.
  void hold_gather(const SceneTool& tool, const SceneVolume& volume, std::size_t v) {
    const auto& h = volume.image.spacing_mm;
    if (cutting_) overlap_.need(overlap_capacity(tool.size_vox, tool.pitch_mm, h));
    if (by_force_) return;
    gradients_[v].need(volume.image.grid.voxel_count() + kFieldPad);
    if (!cutting_) return;
    refresh_.need(1);
    carries_[v].need(removal_lanes(overlap_width(tool.size_vox, tool.pitch_mm, h[0])));
  }

  /// The same in the plan `splat`.
  void hold_splat(const SceneTool& tool, const SceneVolume& volume, std::size_t v) {
    std::array<std::size_t, 3> width{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      width[axis] = overlap_width(tool.size_vox, tool.pitch_mm, volume.image.spacing_mm[axis]);
    }
    scratch_.hold(width, tool.offsets.size());
    if (!by_force_) carries_[v].need(splat_lanes(width[0]));
  }

  /// A tool's samples for the plans that take any pose in fixed point; they stay where they are.
  SampleTable hold_sample_table(const SceneTool& tool) {
    const auto order = cutting_ ? SampleOrder::scattered : SampleOrder::as_given;
    sample_tables_.emplace_back(tool.name, SampleTool(tool.offsets, order));
    return sample_tables_.back().second.table();
  }

  /// Takes the volumes' densities over and allocates the rest; points `plan` and `state` at it.
  void take(LoadedScene& scene, ServoPlan<N>& plan, ServoState<N>& state) {
    for (SceneVolume& volume : scene.volumes) {
      densities_.push_back(std::move(volume.image.density));
    }
    const auto scratch = std::make_unique<GradientScratch>();
    for (std::size_t v = 0; v < plan.volume_count; ++v) {
      const VolumePlan<N>& volume = plan.volumes[v];
      std::vector<Density>& density = densities_[volume.scene_index];
      gradients_[v].allocate();
      carries_[v].allocate();
      if (gradients_[v].bytes() != 0) {
        refresh_gradients<N>(plan.kernel, volume.grid, density, volume.grid.box(),
                             gradients_[v].span(), *scratch);
      }
      state.volumes[v] = {density, gradients_[v].span(), carries_[v].span()};
      if (plan.contact.swept) {
        contact_.take(scene, scene.volumes[volume.scene_index], v, density, state.contact);
      }
    }
    force_cut_.take(scene, plan, state.force_cut);
    overlap_.allocate();
    refresh_.allocate();
    state.overlap.memory = overlap_.span();
    state.gradient_scratch = refresh_.span().data();
    state.scratch = scratch_.view();
  }

  [[nodiscard]] std::span<const Density> density(std::size_t scene_index) const noexcept {
    return densities_[scene_index];
  }

  /// All of it by name, as it is before `take`.
  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    const auto add = [&](const std::string& name, std::size_t bytes, bool taken) {
      if (bytes != 0) list.push_back({name, bytes, taken});
    };
    for (const VolumeBytes& volume : volumes_) {
      add("density of " + volume.name, volume.density, true);
      add("labels of " + volume.name, volume.labels, true);
    }
    for (std::size_t v = 0; v < solid_names_.size(); ++v) {
      add("gradient of " + solid_names_[v], gradients_[v].bytes(), false);
      add("carry of " + solid_names_[v], carries_[v].bytes(), false);
    }
    for (const auto& [name, samples] : samples_) {
      add("samples of " + name, samples.size() * sizeof(ToolOffset), true);
    }
    for (const auto& [name, table] : tables_) add("table of " + name, table->bytes(), true);
    add("overlap box", overlap_.bytes(), false);
    add("refresh planes", refresh_.bytes(), false);
    for (const auto& [name, table] : sample_tables_) {
      add("ordered samples of " + name, table.bytes(), true);
    }
    for (const ArrayBytes& array : scratch_.arrays()) add(array.name, array.bytes, array.taken);
    for (const ArrayBytes& array : contact_.arrays()) add(array.name, array.bytes, array.taken);
    for (const ArrayBytes& array : force_cut_.arrays()) add(array.name, array.bytes, array.taken);
    return list;
  }

 private:
  struct VolumeBytes {
    std::string name;
    std::size_t density, labels;
  };

  bool cutting_, by_force_;
  std::vector<VolumeBytes> volumes_;  ///< by volume of the scene, as the densities
  std::vector<std::string> solid_names_;
  std::vector<std::vector<Density>> densities_;
  std::vector<std::pair<std::string, std::vector<ToolOffset>>> samples_;
  std::vector<std::pair<std::string, std::unique_ptr<AlignedTool>>> tables_;
  std::vector<std::pair<std::string, SampleTool>> sample_tables_;
  std::array<PlannedArray<Gradient<N>>, kMaxVolumes> gradients_;  ///< by volume of the plan
  std::array<PlannedArray<RemovalCarry<N>>, kMaxVolumes> carries_;
  PlannedArray<typename N::Weight> overlap_;
  PlannedArray<GradientScratch> refresh_;
  SplatMemory scratch_;
  ContactMemory<N> contact_;
  ForceCutMemory<N> force_cut_;
};

}  // namespace kerf
