// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/splat_table.hpp"
#include "controller/kernel/tool_offset.hpp"
#include "controller/scene/aligned_tool.hpp"

namespace kerf {

/// In which order kernels meet a tool's samples; exact sums do not depend on it.
enum class SampleOrder {
  as_given,   ///< neighbours follow each other: good for reading
  scattered,  ///< neighbours are far apart: no addition waits for the one before it
};

/// Owner of one tool's samples for the plans `gather` and `splat`. Load time; moving it keeps the
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

/// Owner of the working memory of the plan `splat`, which all tools share. Load time.
class SplatMemory {
 public:
  /// Makes room for a tool that cuts and whose samples touch at most `width_vox` voxels along each
  /// axis, in any orientation (`overlap_width`).
  void hold(const std::array<std::size_t, 3>& width_vox, std::size_t samples);
  /// The part that the plan `aligned` uses.
  [[nodiscard]] AlignedMemory& tick() noexcept { return tick_; }
  [[nodiscard]] SplatScratch view() noexcept;
  /// All arrays by name.
  [[nodiscard]] std::vector<ArrayBytes> arrays() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  AlignedMemory tick_;
  std::array<std::vector<std::int32_t>, 3> place_;
  std::vector<std::int32_t> sums_;
  std::array<std::vector<std::int16_t>, 2> rest_;
  std::vector<std::uint8_t> rest_live_;
};

}  // namespace kerf
