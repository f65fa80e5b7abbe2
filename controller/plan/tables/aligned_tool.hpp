// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/tool_pose.hpp"

namespace kerf {

/// True when the method `aligned` can hold these samples: on one lattice of whole pitches, no two
/// at the same place, at most kMaxAlignedEdge along each axis, at least one.
[[nodiscard]] bool can_align(std::span<const ToolOffset> offsets);

/// The taps of a gradient kernel as exact sums take them.
[[nodiscard]] const ExactTaps& exact_taps(GradientKernel kernel);

/// Owner of one tool's table for the method `aligned`. Load time; moving it keeps the table valid.
class AlignedTool {
 public:
  /// Requires `can_align(offsets)`.
  AlignedTool(std::span<const ToolOffset> offsets, const ExactTaps& taps, const KernelSet& kernels);

  [[nodiscard]] const AlignedTable& table() const noexcept { return table_; }
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  /// Over the box as one stream, for the axis that takes the slope.
  using Table = std::vector<std::int32_t>;
  struct alignas(64) CacheLine {
    std::array<std::int16_t, 32> entry{};
  };

  void keep_mask(std::span<const VoxelIndex> voxels);
  void choose_chunks(std::span<const Table> tables, const KernelSet& kernels);
  void keep_runs(std::span<const Table> tables);

  AlignedTable table_;
  std::array<std::vector<AlignedChunk>, 3> chunks_;
  std::vector<CacheLine> vectors_;
  std::vector<std::uint32_t> mask_;
};

}  // namespace kerf
