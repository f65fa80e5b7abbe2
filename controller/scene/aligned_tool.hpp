// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/aligned_kernels.hpp"
#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/tool_offset.hpp"
#include "controller/scene/scene_costs.hpp"

namespace kerf {

/// True when the plan `aligned` can hold these samples: on one lattice of whole pitches, no two at
/// the same place, at most kMaxAlignedEdge along each axis, at least one.
[[nodiscard]] bool can_align(std::span<const ToolOffset> offsets);

/// The taps of a gradient kernel as exact sums take them.
[[nodiscard]] const AlignedTaps& aligned_taps(GradientKernel kernel);

/// Owner of one tool's table for the plan `aligned`. Load time; moving it keeps the table valid.
class AlignedTool {
 public:
  /// Requires `can_align(offsets)`.
  AlignedTool(std::span<const ToolOffset> offsets, const AlignedTaps& taps,
              const AlignedKernels& kernels);

  [[nodiscard]] const AlignedTable& table() const noexcept { return table_; }
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  /// Over the box as one stream, for the axis that takes the slope.
  using Table = std::vector<std::int32_t>;
  struct alignas(64) CacheLine {
    std::array<std::int16_t, 32> entry{};
  };

  void keep_mask(std::span<const VoxelIndex> voxels);
  void choose_chunks(std::span<const Table> tables, const AlignedKernels& kernels);
  void keep_runs(std::span<const Table> tables);

  AlignedTable table_;
  std::array<std::vector<AlignedChunk>, 3> chunks_;
  std::vector<CacheLine> vectors_;
  std::vector<std::uint32_t> mask_;
};

/// Owner of the working memory that all tools share. Load time.
class AlignedMemory {
 public:
  /// Makes room for a tool; the arrays of milling exist only where some tool `mills`.
  void hold(VoxelIndex tool_size, bool mills);
  [[nodiscard]] AlignedScratch view() noexcept;
  [[nodiscard]] std::vector<ArrayBytes> arrays() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::vector<std::int16_t> box_, ratio_, inside_;
  std::vector<std::int32_t> filter_;
  std::vector<std::uint8_t> live_;
};

}  // namespace kerf
