// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/kernel/splat_table.hpp"

namespace kerf {

/// An array of a compiled scene.
struct ArrayBytes {
  std::string name;
  std::uint64_t bytes = 0;
  bool taken = false;  ///< in memory already when the scene is planned
};
[[nodiscard]] std::uint64_t total_bytes(const std::vector<ArrayBytes>& arrays);

/// Owner of the working memory that all tools share. Load time.
class BoxMemory {
 public:
  /// Makes room for a tool; the arrays of milling exist only where some tool `mills`.
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

}  // namespace kerf
