// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shared/segment/layout.hpp"

namespace kerf::bridge {

inline constexpr std::size_t kTextBlockBytes = 1024;
inline constexpr std::size_t kDensityBlockBytes = 1024;  ///< a brick: 512 densities, x fastest
inline constexpr std::size_t kLabelBlockBytes = 512;     ///< the labels of a brick, likewise
inline constexpr std::uint64_t kConstantVersion = 2;     ///< of text and labels

enum class BlockKind : std::uint8_t { text, density, labels };

/// Blocks of one kind with numbers that follow each other.
struct BlockPlane {
  BlockKind kind;
  std::uint32_t volume;  ///< of density and labels
  std::uint32_t first;   ///< number of its first block
  std::uint32_t count;
  [[nodiscard]] std::size_t block_bytes() const noexcept {
    return kind == BlockKind::labels ? kLabelBlockBytes : kDensityBlockBytes;
  }
};

/// How all that a viewer holds is numbered: scene text (the last block padded with zeros), then
/// each volume's density, then the labels of each volume that has them. Within a volume the number
/// is that of the brick (BrickGrid).
class BlockPlan {
 public:
  BlockPlan() = default;
  /// `volumes`: bricks per volume and whether `off_labels` is not 0.
  BlockPlan(std::uint32_t scene_bytes, std::span<const VolumeDescriptor> volumes);

  [[nodiscard]] const std::vector<BlockPlane>& planes() const noexcept { return planes_; }
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// `id` is below `count()`.
  [[nodiscard]] const BlockPlane& plane_of(std::uint32_t id) const noexcept;

 private:
  void add(BlockKind kind, std::uint32_t volume, std::uint32_t count);

  std::vector<BlockPlane> planes_;
  std::uint32_t count_ = 0;
};

}  // namespace kerf::bridge
