// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/kernel/cut_budget.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/plan/plan_contact.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/point_shell_table.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/volume_restore.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"

// All arrays that a compiled scene steps on, and the snapshot of them. Load time. Only compile.cpp
// includes this.

namespace kerf {

[[noreturn]] inline void refuse_snapshot() {
  throw std::invalid_argument(
      "snapshot: is of another scene; restore it into one that was compiled alike");
}

/// Copies arrays into others of the same sizes.
template <class Arrays>
void restore_arrays(const Arrays& kept, Arrays& arrays) {
  const auto same = [](const auto& a, const auto& b) { return a.size() == b.size(); };
  if (!std::equal(kept.begin(), kept.end(), arrays.begin(), arrays.end(), same)) refuse_snapshot();
  for (std::size_t i = 0; i < kept.size(); ++i) std::ranges::copy(kept[i], arrays[i].begin());
}

/// Fractions of density steps that an arm still owes, by volume of the plan.
template <class N>
using ArmCarries = std::array<std::vector<RemovalCarry<N>>, kMaxVolumes>;

/// The values and arrays of one servo.
template <class N>
struct SnapshotOf final : ServoSnapshot {
  SnapshotOf(Arms<N> arms, const VolumeHistory& kept_history,
             std::vector<std::vector<Density>> density,
             std::array<std::vector<Gradient<N>>, kMaxVolumes> gradient,
             std::vector<ArmCarries<N>> carry,
             std::array<std::vector<std::uint64_t>, kMaxVolumes> blocks,
             std::vector<KeptBrick> stroke_pool,
             std::array<std::vector<std::uint32_t>, kMaxVolumes> stroke_bricks)
      : history(kept_history),
        densities(std::move(density)),
        gradients(std::move(gradient)),
        carries(std::move(carry)),
        cut_blocks(std::move(blocks)),
        pool(std::move(stroke_pool)),
        kept_in(std::move(stroke_bricks)) {
    for (const Arm<N>& arm : arms) states.push_back(*arm.state);
  }

  /// The kept values of an arm, with the memory of `here`.
  [[nodiscard]] ServoState<N> state_in(const ServoState<N>& here, std::size_t arm) const {
    ServoState<N> placed = states[arm];
    placed.volumes = here.volumes;
    placed.overlap = here.overlap;
    placed.gradient_scratch = here.gradient_scratch;
    placed.scratch = here.scratch;
    placed.history = here.history;
    placed.contact.volumes = here.contact.volumes;
    placed.contact.shaft_volumes = here.contact.shaft_volumes;
    placed.force_cut.list = here.force_cut.list;
    return placed;
  }
  [[nodiscard]] VolumeHistory history_in(const VolumeHistory& here) const {
    VolumeHistory placed = history;
    placed.stroke.pool = here.stroke.pool;
    placed.stroke.kept_in = here.stroke.kept_in;
    return placed;
  }

  [[nodiscard]] double largest_carry() const override {
    double largest = 0;
    const auto count = [&](double voxels) { largest = std::max(largest, std::abs(voxels)); };
    for (const ArmCarries<N>& of_arm : carries) {
      for (const auto& by_lane : of_arm) {
        for (const auto owed : by_lane) {
          count(static_cast<double>(owed) / (N::kIsFixed ? 65536.0 : 1.0) / kDensityMax);
        }
      }
    }
    const double voxel = kDensityMax * (N::kIsFixed ? std::ldexp(1.0, kBudgetBits) : 1.0);
    for (const ServoState<N>& state : states) {
      for (const auto& volume : state.force_cut.volume) {
        for (const auto owed : volume.carry) count(static_cast<double>(owed) / voxel);
      }
    }
    return largest;
  }

  [[nodiscard]] std::size_t bytes() const noexcept override {
    std::size_t sum = sizeof *this + std::span(states).size_bytes() + std::span(pool).size_bytes();
    const auto add = [&](const auto& arrays) {
      for (const auto& array : arrays) sum += std::span(array).size_bytes();
    };
    add(densities);
    add(gradients);
    for (const ArmCarries<N>& of_arm : carries) add(of_arm);
    add(cut_blocks);
    add(kept_in);
    return sum;
  }

  /// By arm; pointers are those of the servo that was kept: see `state_in`.
  std::vector<ServoState<N>> states;
  VolumeHistory history;
  std::vector<std::vector<Density>> densities;                  ///< by volume of the scene
  std::array<std::vector<Gradient<N>>, kMaxVolumes> gradients;  ///< by volume of the plan
  std::vector<ArmCarries<N>> carries;                           ///< by arm
  std::array<std::vector<std::uint64_t>, kMaxVolumes> cut_blocks;
  std::vector<KeptBrick> pool;
  std::array<std::vector<std::uint32_t>, kMaxVolumes> kept_in;
};

/// Owner of the arrays of the swept contact: surfaces of the tools, their transformed copies in
/// each volume and the volumes' free bricks. Empty for the paper's force.
template <class N>
class ContactMemory {
 public:
  /// Samples of a tool's surface, at a fixed address.
  PointShell<N> hold_point_shell(const LoadedScene& scene, const SceneTool& tool) {
    const double unit_mm = contact_unit_mm(scene);
    const auto samples = named(scene, [&] { return surface_samples(tool, unit_mm); });
    const auto close = close_samples(tool, unit_mm);
    return hold(tool.name, unit_mm, {samples, close}, tool.round, places_,
                support_deficit_mm(tool.mesh, close));
  }

  /// Holds the samples of the parts behind the tool's head.
  ShaftParts<N> hold_shaft(const LoadedScene& scene, const SceneTool& tool) {
    const double unit_mm = contact_unit_mm(scene);
    ShaftParts<N> shaft;
    for (const ToolPart& part : shaft_parts(tool)) {
      const auto samples = named(scene, [&] { return part_samples(tool, part, unit_mm); });
      auto& places = shaft_places_[shaft.count];
      places.resize(places_.size());
      shaft.part[shaft.count++] = {
          hold(tool.name + "'s " + part.name, unit_mm, samples, false, places),
          typename N::Real(part.middle_mm / unit_mm)};
    }
    return shaft;
  }

  /// Makes room in one more volume of the plan.
  void hold_volume(const SceneVolume& volume) {
    names_.push_back(volume.name);
    const VoxelGrid& grid = volume.image.grid;
    const auto bricks = [](std::int32_t voxels) {
      return static_cast<std::size_t>((voxels + kFreeBrick - 1) / kFreeBrick);
    };
    map_bytes_.push_back(bricks(grid.nx) * bricks(grid.ny) * bricks(grid.nz));
    places_.emplace_back();
  }

  /// The field that contact reads in volume `v` of the plan; `density` is that of the servo.
  void take(const LoadedScene& scene, const SceneVolume& volume, std::size_t v,
            std::span<const Density> density, ContactState<N>& state) {
    const MappedField& field = fields_.emplace_back(volume.image.grid, density, volume.iso);
    state.volumes[v] = {field.field(), contact_frame<N>(scene, volume), places_[v].places()};
    for (std::size_t part = 0; part < kMaxShaftParts; ++part) {
      state.shaft_volumes[part][v] = state.volumes[v];
      if (v < shaft_places_[part].size()) {
        state.shaft_volumes[part][v].places = shaft_places_[part][v].places();
      }
    }
  }

  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    for (const auto& [name, tool] : tools_) {
      list.push_back({"surface of " + name, tool.bytes(), true});
    }
    for (std::size_t v = 0; v < names_.size(); ++v) {
      std::size_t places = places_[v].bytes();
      for (const auto& behind : shaft_places_) places += v < behind.size() ? behind[v].bytes() : 0;
      list.push_back({"places in " + names_[v], places, true});
      list.push_back({"free bricks of " + names_[v], map_bytes_[v], false});
    }
    return list;
  }

 private:
  /// Calls `make`; puts the scene's name before a complaint.
  static auto named(const LoadedScene& scene, const auto& make) {
    try {
      return make();
    } catch (const LoadError& error) {
      throw LoadError(scene.path + ": " + error.what());
    }
  }

  PointShell<N> hold(const std::string& name, double unit_mm, PartSamples mm, bool round,
                     std::vector<TransformedShell<N>>& places, double deficit_mm = 0) {
    for (auto& at : mm.samples) {
      for (double& x : at) x /= unit_mm;
    }
    for (SurfaceSample& sample : mm.close) {
      for (double& x : sample.at) x /= unit_mm;
    }
    const auto& held = tools_
                           .emplace_back(name, PointShellTable<N>(mm.samples, round, mm.close,
                                                                  deficit_mm / unit_mm))
                           .second;
    for (TransformedShell<N>& in_volume : places) in_volume.hold(held.point_shell());
    return held.point_shell();
  }

  std::vector<std::pair<std::string, PointShellTable<N>>> tools_;
  std::vector<std::string> names_;  ///< by volume of the plan
  std::vector<std::size_t> map_bytes_;
  std::vector<TransformedShell<N>> places_;
  std::array<std::vector<TransformedShell<N>>, kMaxShaftParts>
      shaft_places_;  ///< if a tool has a part
  std::vector<MappedField> fields_;
};

/// Owner of the arrays of cutting by force for each volume of the plan: the list of voxels under
/// the tool, and a copy of the labels. Empty in other models.
template <class N>
class ForceCutMemory {
 public:
  /// Reserves the list of a tool in volume `v` of the plan, the next one or a known one.
  void hold(const ToolCase& in, std::size_t v) {
    if (v == volumes_.size()) {
      volumes_.push_back({in.volume.name, in.volume.image.labels.size(), 0, {}, {}});
    }
    std::size_t& length = volumes_[v].length;
    length = std::max(length, max_cover_entries(in, nullptr));
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

/// Owner of all arrays that a compiled scene steps on. First tools and methods reserve in its
/// parts; then `take` allocates. An array that no one reserves does not exist.
template <class N>
class ServoMemory {
 public:
  explicit ServoMemory(const LoadedScene& scene)
      : cuts_(scene.cut.model != CutModel::none),
        carries_(arms_of(scene)),
        methods_(scene.servo.kernel) {
    for (const SceneVolume& volume : scene.volumes) {
      volumes_.push_back({volume.name, volume.image.density.size() * sizeof(Density),
                          volume.image.labels.size() * sizeof(Label)});
      if (!volume.solid) continue;
      solids_.push_back({volume.name, volume.image.grid});
    }
  }

  /// The samples of the next tool, at a fixed address.
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
      for (ArmCarries<N>& of_arm : carries_) of_arm[v].resize(lengths.carry[v]);
      if (!gradients_[v].empty()) {
        refresh_gradients<N>(plan.gradient_kernel, volume.grid, density, volume.grid.box(),
                             gradients_[v], *scratch);
      }
      if (cuts_) {
        firsts_[v] = density;
        cut_blocks_[v].resize(BrickBlocks::of(volume.grid).count());
      }
      state.volumes[v] = {density, gradients_[v], carries_[0][v], firsts_[v], cut_blocks_[v]};
      if (plan.contact.swept) {
        contact_.take(scene, scene.volumes[volume.scene_index], v, density, state.contact);
      }
    }
    if (cuts_) {
      pool_.resize(pool_size());
      history_.stroke.pool = pool_;
      for (std::size_t v = 0; v < plan.volume_count; ++v) {
        kept_in_[v].resize(BrickGrid::of(plan.volumes[v].grid).count());
        history_.stroke.kept_in[v] = kept_in_[v];
      }
    }
    force_cut_.take(scene, plan, state.force_cut);
    overlap_.resize(lengths.overlap);
    refresh_.resize(lengths.refresh);
    state.overlap.memory = overlap_;
    state.gradient_scratch = refresh_.data();
    state.scratch = methods_.scratch.view();
    state.history = &history_;
  }

  /// Makes a second arm of the state of the first, after `take` and before the first step: the same
  /// volumes and scratch, since the arms take turns, and fractions of its own.
  void share(const ServoState<N>& first, ServoState<N>& second) {
    const std::uint32_t tool = second.active_tool;
    second = first;
    second.active_tool = tool;
    for (std::size_t v = 0; v < kMaxVolumes; ++v) second.volumes[v].carry = carries_[1][v];
  }

  [[nodiscard]] std::span<const Density> density(std::size_t scene_index) const noexcept {
    return densities_[scene_index];
  }

  /// After `take`.
  [[nodiscard]] SnapshotOf<N> keep(Arms<N> arms) const {
    return {arms, history_, densities_, gradients_, carries_, cut_blocks_, pool_, kept_in_};
  }
  /// Copies the snapshot into the existing arrays. Their addresses do not change, because plan and
  /// state point to them. Throws std::invalid_argument if the snapshot is from another scene.
  void restore(const SnapshotOf<N>& kept, Arms<N> arms) {
    if (kept.states.size() != arms.size()) refuse_snapshot();
    restore_arrays(kept.densities, densities_);
    restore_arrays(kept.gradients, gradients_);
    for (std::size_t a = 0; a < arms.size(); ++a) restore_arrays(kept.carries[a], carries_[a]);
    restore_arrays(kept.cut_blocks, cut_blocks_);
    restore_arrays(kept.kept_in, kept_in_);
    if (kept.pool.size() != pool_.size()) refuse_snapshot();
    std::ranges::copy(kept.pool, pool_.begin());
    history_ = kept.history_in(history_);
    for (std::size_t a = 0; a < arms.size(); ++a) {
      *arms[a].state = kept.state_in(*arms[a].state, a);
    }
  }

  /// All arrays by name, with their sizes before `take`.
  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    const auto add = [&](const std::string& name, std::uint64_t bytes, bool taken) {
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
      add("carry of " + name, carries_.size() * lengths.carry[v] * sizeof(RemovalCarry<N>), false);
      if (!cuts_) continue;
      add("first content of " + name, grid.voxel_count() * sizeof(Density), false);
      add("cut bricks of " + name, BrickBlocks::of(grid).count() * sizeof(std::uint64_t), false);
    }
    if (cuts_) {
      std::size_t stamps = 0;
      for (const auto& [name, grid] : solids_) stamps += BrickGrid::of(grid).count();
      add("bricks of the last strokes", pool_size() * sizeof(KeptBrick), false);
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
  /// Entries for the bricks of the strokes that can be undone, and for those that may be cut next:
  /// 16 MiB hold 8 cm^3 of voxels of 0.1 mm, several teeth; small volumes fit whole into each.
  [[nodiscard]] std::size_t pool_size() const {
    constexpr std::size_t kMost = (std::size_t{16} << 20) / sizeof(KeptBrick);
    std::size_t bricks = 0;
    for (const auto& [name, grid] : solids_) bricks += BrickGrid::of(grid).count();
    return std::min((kUndoLevels + 2) * bricks, kMost);
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
  std::vector<ArmCarries<N>> carries_;                           ///< by arm
  std::array<std::vector<Density>, kMaxVolumes> firsts_;         ///< if the scene cuts, as the next
  std::array<std::vector<std::uint64_t>, kMaxVolumes> cut_blocks_;
  VolumeHistory history_;
  std::vector<KeptBrick> pool_;  ///< of the last strokes, as the next
  std::array<std::vector<std::uint32_t>, kMaxVolumes> kept_in_;
  std::vector<typename N::Weight> overlap_;
  std::vector<GradientScratch> refresh_;
  MethodMemory methods_;
  ContactMemory<N> contact_;
  ForceCutMemory<N> force_cut_;
};

}  // namespace kerf
