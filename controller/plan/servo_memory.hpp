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
#include "controller/plan/contact_memory.hpp"
#include "controller/plan/force_cut_memory.hpp"
#include "controller/plan/method/method_memory.hpp"
#include "controller/plan/servo_snapshot.hpp"
#include "controller/plan/tables/tick_memory.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/volume_reset.hpp"

namespace kerf {

/// Owner of all arrays that a compiled scene steps on. First tools and methods tell its parts what
/// they need; then `take` makes the memory. What nobody needs does not exist. Load time.
template <class N>
class ServoMemory {
 public:
  explicit ServoMemory(const LoadedScene& scene)
      : cuts_(scene.cut.model != CutModel::none), methods_(scene.servo.kernel) {
    for (const SceneVolume& volume : scene.volumes) {
      volumes_.push_back({volume.name, volume.image.density.size() * sizeof(Density),
                          volume.image.labels.size() * sizeof(Label)});
      if (!volume.solid) continue;
      solids_.push_back({volume.name, volume.image.grid});
    }
  }

  /// The samples of the next tool; they stay where they are.
  std::span<const ToolOffset> hold_samples(const SceneTool& tool) {
    return samples_.emplace_back(tool.name, tool.offsets).second;
  }

  [[nodiscard]] ContactMemory<N>& contact() noexcept { return contact_; }
  [[nodiscard]] ForceCutMemory<N>& force_cut() noexcept { return force_cut_; }
  [[nodiscard]] MethodMemory& methods() noexcept { return methods_; }

  /// Takes the volumes' densities over and allocates the rest; points `plan` and `state` at it.
  void take(LoadedScene& scene, ServoPlan<N>& plan, ServoState<N>& state) {
    for (SceneVolume& volume : scene.volumes) {
      densities_.push_back(std::move(volume.image.density));
    }
    const MethodMemory::Lengths& lengths = methods_.lengths;
    const auto scratch = std::make_unique<GradientScratch>();
    for (std::size_t v = 0; v < plan.volume_count; ++v) {
      const VolumePlan<N>& volume = plan.volumes[v];
      std::vector<Density>& density = densities_[volume.scene_index];
      gradients_[v].resize(lengths.gradients[v]);
      carries_[v].resize(lengths.carry[v]);
      if (!gradients_[v].empty()) {
        refresh_gradients<N>(plan.kernel, volume.grid, density, volume.grid.box(), gradients_[v],
                             *scratch);
      }
      if (cuts_) {
        firsts_[v] = density;
        cut_blocks_[v].resize(BrickBlocks::of(volume.grid).count());
      }
      state.volumes[v] = {density, gradients_[v], carries_[v], firsts_[v], cut_blocks_[v]};
      if (plan.contact.swept) {
        contact_.take(scene, scene.volumes[volume.scene_index], v, density, state.contact);
      }
    }
    if (cuts_) {
      pool_.resize(pool_size());
      state.stroke.pool = pool_;
      for (std::size_t v = 0; v < plan.volume_count; ++v) {
        kept_in_[v].resize(BrickGrid::of(plan.volumes[v].grid).count());
        state.stroke.kept_in[v] = kept_in_[v];
      }
    }
    force_cut_.take(scene, plan, state.force_cut);
    overlap_.resize(lengths.overlap);
    refresh_.resize(lengths.refresh);
    state.overlap.memory = overlap_;
    state.gradient_scratch = refresh_.data();
    state.scratch = methods_.scratch.view();
  }

  [[nodiscard]] std::span<const Density> density(std::size_t scene_index) const noexcept {
    return densities_[scene_index];
  }

  /// After `take`.
  [[nodiscard]] SnapshotOf<N> keep(const ServoState<N>& state) const {
    return {state, densities_, gradients_, carries_, cut_blocks_, pool_, kept_in_};
  }
  /// The arrays keep their places: plan and state point at them. Throws std::invalid_argument where
  /// the snapshot is of another scene.
  void restore(const SnapshotOf<N>& kept, ServoState<N>& state) {
    restore_arrays(kept.densities, densities_);
    restore_arrays(kept.gradients, gradients_);
    restore_arrays(kept.carries, carries_);
    restore_arrays(kept.cut_blocks, cut_blocks_);
    restore_arrays(kept.kept_in, kept_in_);
    if (kept.pool.size() != pool_.size()) refuse_snapshot();
    std::ranges::copy(kept.pool, pool_.begin());
    state = kept.state_in(state);
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
    const MethodMemory::Lengths& lengths = methods_.lengths;
    for (std::size_t v = 0; v < solids_.size(); ++v) {
      const auto& [name, grid] = solids_[v];
      add("gradient of " + name, lengths.gradients[v] * sizeof(Gradient<N>), false);
      add("carry of " + name, lengths.carry[v] * sizeof(RemovalCarry<N>), false);
      if (!cuts_) continue;
      add("first content of " + name, grid.voxel_count() * sizeof(Density), false);
      add("cut bricks of " + name, BrickBlocks::of(grid).count() * sizeof(std::uint64_t), false);
    }
    if (cuts_) {
      std::size_t stamps = 0;
      for (const auto& [name, grid] : solids_) stamps += BrickGrid::of(grid).count();
      add("bricks of the last stroke", pool_size() * sizeof(KeptBrick), false);
      add("whether they are kept", stamps * sizeof(std::uint32_t), false);
    }
    for (const auto& [name, samples] : samples_) {
      add("samples of " + name, samples.size() * sizeof(ToolOffset), true);
    }
    add("overlap box", lengths.overlap * sizeof(typename N::Weight), false);
    add("refresh planes", lengths.refresh * sizeof(GradientScratch), false);
    for (const ArrayBytes& array : methods_.arrays()) add(array.name, array.bytes, array.taken);
    for (const ArrayBytes& array : contact_.arrays()) add(array.name, array.bytes, array.taken);
    for (const ArrayBytes& array : force_cut_.arrays()) add(array.name, array.bytes, array.taken);
    return list;
  }

 private:
  /// Of the bricks of a stroke, and of those that may be cut next: 16 MiB hold 8 cm^3 of voxels of
  /// 0.1 mm, a tooth several times over; small volumes fit whole.
  [[nodiscard]] std::size_t pool_size() const {
    constexpr std::size_t kMost = (std::size_t{16} << 20) / sizeof(KeptBrick);
    std::size_t bricks = 0;
    for (const auto& [name, grid] : solids_) bricks += BrickGrid::of(grid).count();
    return std::min(2 * bricks, kMost);
  }

  struct VolumeBytes {
    std::string name;
    std::size_t density, labels;
  };

  std::vector<VolumeBytes> volumes_;  ///< by volume of the scene, as the densities
  std::vector<std::pair<std::string, VoxelGrid>> solids_;
  bool cuts_;
  std::vector<std::vector<Density>> densities_;
  std::vector<std::pair<std::string, std::vector<ToolOffset>>> samples_;
  std::array<std::vector<Gradient<N>>, kMaxVolumes> gradients_;  ///< by volume of the plan
  std::array<std::vector<RemovalCarry<N>>, kMaxVolumes> carries_;
  std::array<std::vector<Density>, kMaxVolumes> firsts_;  ///< where something is cut, as the next
  std::array<std::vector<std::uint64_t>, kMaxVolumes> cut_blocks_;
  std::vector<KeptBrick> pool_;  ///< of the last stroke, as the next
  std::array<std::vector<std::uint32_t>, kMaxVolumes> kept_in_;
  std::vector<typename N::Weight> overlap_;
  std::vector<GradientScratch> refresh_;
  MethodMemory methods_;
  ContactMemory<N> contact_;
  ForceCutMemory<N> force_cut_;
};

}  // namespace kerf
