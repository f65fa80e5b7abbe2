// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "controller/kernel/tool_pose.hpp"

namespace kerf {

/// The lattice of a tool's inner samples: `across` a side along x and z, `along` the shaft's axis
/// y, around the tool's centre. Load time.
class SampleLattice {
 public:
  SampleLattice(std::int32_t across, std::int32_t along)
      : across_(across),
        along_(along),
        kept_(static_cast<std::size_t>(across * across * along)),
        added_(kept_.size()) {}

  /// Keeps the sample at an index along each axis, 0 up to one before the side's length.
  void keep(std::int32_t x, std::int32_t y, std::int32_t z) { kept_[index(x, y, z)] = true; }

  /// Sees to it that what the tool rests on is cut. `place` is one of its surface, in pitches from
  /// the centre. Where the kept samples would cover hardly anything of a voxel there, the nearest
  /// of the lattice is added, or all that are as near; it may lie outside of the tool. Call it for
  /// places of the whole surface, once all is kept; their order does not matter.
  ///
  /// Samples of a rim or a point end inside of the surface: of a circle of 3.04 pitches, in a layer
  /// that is a little narrower, the lattice has 2 along its axes. Matter beyond is felt and never
  /// cut, so the tool would rest on it for ever (docs/theory.md 6.3).
  void cover(const std::array<double, 3>& place);

  /// The side along x and z that samples take up: `across`, less the empty planes at its ends.
  [[nodiscard]] std::int32_t taken_across() const;

  /// Of all samples, ordered by y, then z, then x.
  [[nodiscard]] std::vector<ToolOffset> offsets() const;

 private:
  [[nodiscard]] bool has(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return kept_[index(x, y, z)] || added_[index(x, y, z)];
  }
  [[nodiscard]] std::size_t index(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return static_cast<std::size_t>((y * across_ + z) * across_ + x);
  }

  std::int32_t across_, along_;
  std::vector<bool> kept_, added_;
};

}  // namespace kerf
