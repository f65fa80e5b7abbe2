// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "tests/kernel/definitions.hpp"
#include "tests/kernel/support.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::test {

/// `gradient_exact` of any voxel of a volume as it is now, made when it is first asked for: a tool
/// meets few of them. Zero where the volume does not reach.
class ExactField {
 public:
  ExactField(const ExactTaps& taps, TestVolume volume)
      : taps_(taps),
        volume_(std::move(volume)),
        grid_{volume_.grid.nx + 4, volume_.grid.ny + 4, volume_.grid.nz + 4},
        values_(grid_.voxel_count()) {}

  SumVec<FixedNumbers> operator()(VoxelIndex v) const {
    const VoxelIndex at{v.x + 2, v.y + 2, v.z + 2};
    if (!grid_.contains(at)) return {};
    auto& value = values_[grid_.index(at.x, at.y, at.z)];
    if (!value) value = gradient_exact(taps_, volume_.grid, volume_.density, v);
    return *value;
  }

 private:
  const ExactTaps& taps_;
  TestVolume volume_;
  VoxelGrid grid_;
  mutable std::vector<std::optional<SumVec<FixedNumbers>>> values_;
};

/// About half the voxels of a box: full of holes, and not centred.
inline std::vector<ToolOffset> ragged_tool(int nx, int ny, int nz, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<ToolOffset> offsets;
  for (const ToolOffset& offset : box_tool(nx, ny, nz)) {
    if ((random() & 1) != 0) offsets.push_back(offset);
  }
  return offsets;
}

inline constexpr int kFills = 12;

/// Densities that hurt: empty, full, the finest patterns, single voxels, noise of several kinds.
inline TestVolume hard_volume(VoxelGrid grid, int fill, std::uint32_t seed) {
  std::mt19937 random(seed);
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) -> Density {
    const auto noise = static_cast<Density>(random() >> 16);
    switch (fill) {
      case 0:
        return 0;
      case 1:
        return 65535;
      case 2:
        return (x + y + z) % 2 != 0 ? 65535 : 0;
      case 3:
        return noise;
      case 4:
        return noise > 32767 ? 65535 : 0;
      case 5:
        return x / 2 % 2 != 0 ? 65535 : 0;
      case 6:
        return z < grid.nz / 2 ? 65535 : 0;
      case 7:
        return noise % 5 == 0 ? noise : Density{0};
      case 8:
        return static_cast<Density>(x * 65535 / std::max(1, grid.nx - 1));
      case 9:
        return x == grid.nx / 2 && y == grid.ny / 2 && z == grid.nz / 2 ? 65535 : 0;
      case 10:
        return 1;
      default:
        return y / 4 % 2 != 0 ? 65535 : 0;
    }
  });
}

/// A centre with these raw Q15.16 coordinates.
inline ToolPose<FixedNumbers> pose_of(std::array<std::int32_t, 3> raw) {
  ToolPose<FixedNumbers> pose = pose_at({0, 0, 0});
  pose.centre_vox = {Q16::from_raw(raw[0]), Q16::from_raw(raw[1]), Q16::from_raw(raw[2])};
  return pose;
}

/// Inside, across any face, edge or corner of the volume, or outside; every third or so on the
/// lattice, half-way, or a step beside.
inline ToolPose<FixedNumbers> random_pose(const VoxelGrid& grid, VoxelIndex tool_size,
                                          std::mt19937& random) {
  const std::array<std::int32_t, 3> edge{grid.nx, grid.ny, grid.nz};
  const std::array<std::int32_t, 3> size{tool_size.x, tool_size.y, tool_size.z};
  constexpr std::array<std::int32_t, 6> kFractions{0, 1, 0x7fff, 0x8000, 0xfffe, 0xffff};
  const auto kind = random() % 4;  // across faces, inside, or each axis as it comes
  std::array<std::int32_t, 3> raw{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int32_t reach = size[axis] / 2 + 4;
    const auto whole_between = [&](std::int32_t low, std::int32_t high) {
      return std::uniform_int_distribution<std::int32_t>(low, std::max(low, high))(random);
    };
    std::int32_t whole = 0;
    switch (kind == 0 ? 4 + random() % 2 : kind == 1 ? 3 : random() % 7) {
      case 3:
        whole = whole_between(size[axis] / 2 + 2, edge[axis] - size[axis] / 2 - 4);
        break;
      case 4:
        whole = whole_between(-reach, reach);
        break;
      case 5:
        whole = edge[axis] - whole_between(-reach, reach);
        break;
      case 6:
        whole = whole_between(-2 * reach, edge[axis] + 2 * reach);
        break;
      default:
        whole = whole_between(0, edge[axis] - 1);
    }
    const auto fraction = random() % 3 == 0 ? kFractions[random() % kFractions.size()]
                                            : static_cast<std::int32_t>(random() & 0xffff);
    raw[axis] = whole * 65536 + fraction;
  }
  return pose_of(raw);
}

/// All that one tick gives and changes.
struct AlignedOutcome {
  SumVec<FixedNumbers> contact, modification;
  Removed removed;
  std::vector<Density> density;
  std::vector<std::uint16_t> carry;

  friend bool operator==(const AlignedOutcome& a, const AlignedOutcome& b) {
    return a.contact == b.contact && a.modification == b.modification &&
           a.removed.density_steps == b.removed.density_steps &&
           (a.removed.changed == b.removed.changed || a.removed.density_steps == 0) &&
           a.density == b.density && a.carry == b.carry;
  }
};

/// By the definitions.
inline AlignedOutcome outcome_by_definition(const ExactTaps& taps, const TestVolume& volume,
                                            const ExactField& field,
                                            std::span<const ToolOffset> tool,
                                            const ToolPose<FixedNumbers>& pose,
                                            const RemovalRate<FixedNumbers>& rate,
                                            const std::vector<std::uint16_t>& carry,
                                            OverlapBox<FixedNumbers>& scratch) {
  AlignedOutcome out{{}, {}, {}, volume.density, carry};
  out.contact = aligned_contact_sum(taps, field, tool, pose);
  overlap(volume.grid, tool, pose, FixedNumbers::kStepOne, scratch);
  out.modification =
      exact_modification_sum(field, volume.grid, volume.density, scratch, tool.size());
  out.removed = remove<FixedNumbers>(volume.grid, out.density, scratch, rate, out.carry);
  return out;
}

/// One tool with the memory to run it on one instruction set.
class AlignedRig {
 public:
  AlignedRig(std::span<const ToolOffset> offsets, const ExactTaps& taps, const KernelSet& kernels)
      : kernels_(&kernels), tool_(offsets, taps, kernels) {
    memory_.hold(tool_.table().size, true);
  }
  [[nodiscard]] const AlignedTable& table() const { return tool_.table(); }
  [[nodiscard]] const KernelSet& kernels() const { return *kernels_; }

  /// The same tick with a table that may differ from the rig's.
  AlignedOutcome run(const TestVolume& volume, const ToolPose<FixedNumbers>& pose,
                     const RemovalRate<FixedNumbers>& rate, const std::vector<std::uint16_t>& carry,
                     const AlignedTable& table) {
    AlignedOutcome out{{}, {}, {}, volume.density, carry};
    const BoxScratch scratch = memory_.view();
    const AlignedTick tick(*kernels_, table, scratch, volume.grid, out.density, pose);
    out.contact = tick.contact();
    const AlignedTick::Milled milled = tick.mill(rate, out.carry);
    out.modification = milled.modification;
    out.removed = milled.removed;
    return out;
  }
  AlignedOutcome run(const TestVolume& volume, const ToolPose<FixedNumbers>& pose,
                     const RemovalRate<FixedNumbers>& rate,
                     const std::vector<std::uint16_t>& carry) {
    return run(volume, pose, rate, carry, table());
  }

 private:
  const KernelSet* kernels_;
  AlignedTool tool_;
  BoxMemory memory_;
};

/// A rig for each instruction set of this machine.
inline std::vector<AlignedRig> rigs_for(std::span<const ToolOffset> offsets,
                                        const ExactTaps& taps = kExactFarid) {
  std::vector<AlignedRig> rigs;
  for (auto set = sets_to_run(); *set != nullptr; ++set) rigs.emplace_back(offsets, taps, **set);
  return rigs;
}

}  // namespace kerf::test
