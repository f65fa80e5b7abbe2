// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/tool/tool_shapes.hpp"

// The samples inside of a tool: their lattice, and those of a mesh.

namespace kerf {

/// The lattice of a tool's inner samples: `across` a side along x and z, `along` the shaft's axis
/// y, around the tool's centre. Load time.
class SampleLattice {
 public:
  SampleLattice(std::int32_t across, std::int32_t along)
      : across_(across),
        along_(along),
        kept_(static_cast<std::size_t>(across) * static_cast<std::size_t>(across) *
              static_cast<std::size_t>(along)),
        added_(kept_.size()) {}

  /// Keeps the sample at an index along each axis, 0 up to one before the side's length.
  void keep(std::int32_t x, std::int32_t y, std::int32_t z) { kept_[index(x, y, z)] = true; }

  /// Makes sure that the tool cuts the voxels it rests on. `place` is a position on its surface, in
  /// pitches from the centre. If the kept samples would cover almost nothing of a voxel there, the
  /// nearest of the lattice is added, or all that are as near; it may lie outside of the tool. Call
  /// it for positions of the whole surface, after all calls of `keep`; their order does not matter.
  ///
  /// Samples of a rim or a point end inside of the surface: of a circle of 3.04 pitches, in a layer
  /// that is a little narrower, the lattice has 2 along its axes. Voxels beyond are in contact and
  /// never cut, so the tool would rest on them for ever (docs/forces.md 6.3).
  void cover(const std::array<double, 3>& place);

  /// Side of the samples along x and z: `across`, less the empty planes at its ends.
  [[nodiscard]] std::int32_t taken_across() const;

  /// All samples, ordered by y, then z, then x.
  [[nodiscard]] std::vector<ToolOffset> offsets() const;

 private:
  [[nodiscard]] bool has(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return kept_[index(x, y, z)] || added_[index(x, y, z)];
  }
  [[nodiscard]] std::size_t index(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const auto across = static_cast<std::size_t>(across_);
    return (static_cast<std::size_t>(y) * across + static_cast<std::size_t>(z)) * across +
           static_cast<std::size_t>(x);
  }

  std::int32_t across_, along_;
  std::vector<bool> kept_, added_;
};

/// Largest number of pitches along one side of the tool; cheap, for checks before
/// `make_mesh_tool` allocates.
[[nodiscard]] double mesh_side_vox(const ToolMesh& mesh, double pitch_mm);

/// The samples of one tool: those of a grid whose middle across the axis is a sample, as of tools
/// with a radius, kept if they are inside or on the surface. `mesh_side_vox` is at most
/// kMaxToolSide. None if the mesh is thinner than the grid. Ordered by y, then z, then x.
///
/// Inside means a winding number above 0, so bodies that overlap are one. It is counted along
/// columns of samples in whole numbers, with ties broken the same way for both triangles of an
/// edge: a closed mesh has no leak. Load time.
[[nodiscard]] SceneTool make_mesh_tool(std::string name, ToolMesh mesh, double pitch_mm);

}  // namespace kerf
