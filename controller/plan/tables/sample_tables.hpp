// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/sampling.hpp"

// Classes that own the memory of the overlap methods: scratch of a tick that all tools use, the
// ordered samples of `gather` and `splat` (SampleTool), the table of `aligned` (AlignedTool).

namespace kerf {

/// An array of a compiled scene.
struct ArrayBytes {
  std::string name;
  std::uint64_t bytes = 0;
  bool taken = false;  ///< allocated before the scene is planned
};
[[nodiscard]] std::uint64_t total_bytes(const std::vector<ArrayBytes>& arrays);

/// Owner of the working memory that all tools share. Load time.
class BoxMemory {
 public:
  /// Makes room for a tool; the arrays of milling exist only if some tool `mills`.
  void hold(VoxelIndex tool_size, bool mills);
  [[nodiscard]] BoxScratch view() noexcept;
  [[nodiscard]] std::vector<ArrayBytes> arrays() const;

 private:
  std::vector<std::int16_t> box_, ratio_, inside_;
  std::vector<std::int32_t> filter_;
  std::vector<std::uint8_t> live_;
};

/// Owner of the working memory of the method `splat`, which all tools share. Load time.
class SplatMemory {
 public:
  /// Makes room for a tool that cuts and whose samples touch at most `width_vox` voxels along each
  /// axis, in any orientation (`overlap_width`).
  void hold(const std::array<std::size_t, 3>& width_vox, std::size_t samples);
  /// The part that the method `aligned` uses.
  [[nodiscard]] BoxMemory& tick() noexcept { return tick_; }
  [[nodiscard]] SplatScratch view() noexcept;
  /// All arrays by name.
  [[nodiscard]] std::vector<ArrayBytes> arrays() const;

 private:
  BoxMemory tick_;
  std::array<std::vector<std::int32_t>, 3> place_;
  std::vector<std::int32_t> sums_;
  std::array<std::vector<std::int16_t>, 2> rest_;
  std::vector<std::uint8_t> rest_live_;
};

/// Order in which kernels read the samples of a tool; exact sums do not depend on it.
enum class SampleOrder {
  as_given,   ///< neighbours follow each other: good for reading
  scattered,  ///< neighbours are far apart: no addition waits for the one before it
};

/// Owner of one tool's samples for the methods `gather` and `splat`. Load time; moving it keeps the
/// table valid.
class SampleTool {
 public:
  SampleTool(std::span<const ToolOffset> offsets, SampleOrder order);

  [[nodiscard]] SampleTable table() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  std::array<std::vector<std::int32_t>, 3> offset_;
  std::int32_t count_;
};

/// True if the method `aligned` can hold these samples: on one lattice of whole pitches, no two at
/// the same position, at most kMaxAlignedEdge along each axis, at least one.
[[nodiscard]] bool can_align(std::span<const ToolOffset> offsets);

/// The taps of a gradient kernel for exact sums.
[[nodiscard]] const ExactTaps& exact_taps(GradientKernel kernel);

/// Owner of one tool's table for the method `aligned`. Load time; moving it keeps the table valid.
class AlignedTool {
 public:
  /// Requires `can_align(offsets)`.
  AlignedTool(std::span<const ToolOffset> offsets, const ExactTaps& taps, const KernelSet& kernels);

  [[nodiscard]] const AlignedTable& table() const noexcept { return table_; }
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  /// One axis' entries over the box as one stream.
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
