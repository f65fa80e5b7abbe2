// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/plan_choice.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// An array whose size is known before its memory is taken; empty where nothing needs it.
template <class T>
class PlannedArray {
 public:
  /// Several users share it: the largest wish counts.
  void need(std::size_t count) { count_ = std::max(count_, count); }
  void allocate() { memory_.resize(count_); }
  [[nodiscard]] std::size_t bytes() const noexcept { return count_ * sizeof(T); }
  [[nodiscard]] std::span<T> span() noexcept { return memory_; }

 private:
  std::size_t count_ = 0;
  std::vector<T> memory_;
};

/// Owner of all arrays that a compiled scene steps on: first their sizes, by what the tools need,
/// then their memory. Only what some tool needs exists. Load time.
template <class N>
class ServoMemory {
 public:
  explicit ServoMemory(bool cutting) : cutting_(cutting) {}

  /// A tool will touch volume `v` of the plan by `plan`; `table` is set for the plan `aligned`.
  void hold(const SceneTool& tool, const SceneVolume& volume, std::size_t v, Plan plan,
            const AlignedTable* table) {
    switch (plan) {
      case Plan::aligned:
        hold_aligned(v, *table);
        break;
      case Plan::gather:
        hold_gather(tool, volume, v);
        break;
    }
  }

  /// Takes the volumes' densities over and allocates the rest; points `state` at it.
  void take(Scene& scene, const ServoPlan<N>& plan, ServoState<N>& state) {
    for (SceneVolume& volume : scene.volumes) {
      densities_.push_back(std::move(volume.image.density));
    }
    auto refresh = std::make_unique<GradientScratch>();
    for (std::size_t v = 0; v < plan.volume_count; ++v) {
      const VolumePlan<N>& volume = plan.volumes[v];
      std::vector<Density>& density = densities_[volume.scene_index];
      gradients_[v].allocate();
      carries_[v].allocate();
      if (gradients_[v].bytes() != 0) {
        refresh_gradients<N>(plan.kernel, volume.grid, density, volume.grid.box(),
                             gradients_[v].span(), *refresh);
      }
      state.volumes[v] = {density, gradients_[v].span(), carries_[v].span()};
    }
    overlap_.allocate();
    refresh_.allocate();
    state.overlap.memory = overlap_.span();
    state.gradient_scratch = refresh_.span().data();
    state.aligned_scratch = aligned_.view();
  }

  [[nodiscard]] std::span<const Density> density(std::size_t scene_index) const noexcept {
    return densities_[scene_index];
  }

 private:
  void hold_aligned(std::size_t v, const AlignedTable& table) {
    aligned_.hold(table.size, cutting_);
    if (cutting_) carries_[v].need(static_cast<std::size_t>(table.row_lanes));
  }

  void hold_gather(const SceneTool& tool, const SceneVolume& volume, std::size_t v) {
    const auto& h = volume.image.spacing_mm;
    gradients_[v].need(volume.image.grid.voxel_count());
    if (!cutting_) return;
    refresh_.need(1);
    carries_[v].need(removal_lanes(overlap_width(tool.size_vox, tool.pitch_mm, h[0])));
    overlap_.need(overlap_capacity(tool.size_vox, tool.pitch_mm, h));
  }

  bool cutting_;
  std::vector<std::vector<Density>> densities_;                   ///< by volume of the scene
  std::array<PlannedArray<Gradient<N>>, kMaxVolumes> gradients_;  ///< by volume of the plan
  std::array<PlannedArray<RemovalCarry<N>>, kMaxVolumes> carries_;
  PlannedArray<typename N::Weight> overlap_;
  PlannedArray<GradientScratch> refresh_;
  AlignedMemory aligned_;
};

}  // namespace kerf
