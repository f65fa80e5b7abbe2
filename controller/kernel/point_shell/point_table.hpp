// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/point_shell/free_bricks.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/volume/voxel_grid.hpp"

// The shell: samples on the surface of a tool, which contact reads the density at
// (contact.md 1). Plain structs that kernels of any instruction set take.
namespace kerf {

/// A number of the shell's kernels; in fixed a plain integer, in the format that is told with it.
template <class N>
using PointNumber = typename N::Weight;

inline constexpr std::int32_t kPointGroup =
    16;  ///< samples that lie together; counts are multiples
inline constexpr std::int32_t kMaxShellPoints = 8192;  ///< sums then fit 53 bits

/// A tool's samples, axis by axis in the tool's axes. Made at load
/// (controller/plan/tool_points.hpp) and points into the maker's memory.
template <class N>
struct PointTable {
  const PointNumber<N>* offset[3] = {};  ///< from the tool's centre, over its reach; Q0.15
  const PointNumber<N>* middle[3] = {};  ///< of each group, the same
  const std::uint8_t* bricks = nullptr;  ///< `free_bricks_for` each group
  std::int32_t count = 0;                ///< of samples
  std::int32_t groups = 0;
  bool round = false;      ///< a ball: the offset is the normal
  PointNumber<N> reach{};  ///< no offset of a sample is longer; voxels, Q15.16
};

/// The step from offsets to voxels of one volume: offset_i = (SUM_k row[i][k] offset[k]) 2^-shift
/// in Q15.16, rounded half up. In fixed |row[i]| <= 65000 and |offset| <= 2^15, but for their
/// roundings, so no sum leaves 31 bits. A ball's caps have offsets of up to 1.42 times that, but
/// rows of 53248 at most, made so that no offset is above 1.04 radii. In floating point there is no
/// shift.
template <class N>
struct PointStep {
  PointNumber<N> row[3][3] = {};
  std::int32_t shift = 1;
};

/// Offset of what is no sample: beyond every volume, wherever the tool is near one; voxels.
inline constexpr std::int32_t kNoSampleVox = 1 << 14;

/// A turned tool in one volume, in voxels; Q15.16. As long as the table's arrays.
template <class N>
struct PointPlaces {
  PointNumber<N>* offset_vox[3] = {};  ///< of the samples from the centre
  PointNumber<N>* middle[3] = {};      ///< of the groups
};

/// Takes densities to those of contact, in which the iso-surface is at 1/2:
/// density / 2 * mantissa * 2^-shift, in 2^-15. `mantissa` has 16 bits.
struct DensityScale {
  std::uint32_t mantissa = 32768;
  std::int32_t shift = 15;  ///< 0..16
};

/// An iso of 0 counts as 1.
[[nodiscard]] constexpr DensityScale density_scale(Density iso) noexcept {
  const std::uint64_t level = iso == 0 ? 1 : iso;
  DensityScale scale{0, -1};
  while (scale.mantissa < 32768) {
    const std::uint64_t whole = std::uint64_t{32768} << ++scale.shift;
    scale.mantissa = static_cast<std::uint32_t>((whole + level / 2) / level);
  }
  return scale;
}

template <class S>
[[nodiscard]] constexpr S scale_factor(const DensityScale& scale) noexcept {
  return S(scale.mantissa) / S(std::int32_t{1} << scale.shift);
}

/// What the shell reads in one volume; `density` changes as material is cut.
struct DensityField {
  VoxelGrid grid;
  const Density* density = nullptr;
  DensityScale scale;
  FreeBricks free;
};

/// Sums over the samples, r the density of contact, w = r^p, p = 4 for balls and 6 for the rest.
/// v = w, but 3 w - w / r for balls: half the derivative of their peak (contact_peak.hpp) where it
/// is at the iso, but for SUM w. Offsets are weighted with u = w, but w r for balls: where density
/// begins trilinear reads are raised, and over a normal near an axis of the voxels, whose layers
/// cross the contact in bands, that would tilt a ball's normal. In fixed r is Q15, the weights are
/// Q24, gradients are in the volume's densities over 2, offsets in Q0.15. Exact, so that no order
/// and no instruction set matters: |sum| < 2^53.
template <class N>
struct PointSums {
  typename N::Sum weight{};          ///< SUM w
  typename N::Sum density{};         ///< SUM w r
  typename N::Sum square{};          ///< SUM w r^2, r^2 in Q16; 0 for balls
  typename N::Sum gradient[3] = {};  ///< SUM v grad, voxel axes
  typename N::Sum offset[3] = {};    ///< SUM u offset
  typename N::Sum high{};            ///< SUM w r^2, which weights `high_offset`; 0 for balls
  typename N::Sum high_offset[3] = {};
  PointNumber<N> top{};         ///< the largest r
  std::int32_t top_sample = 0;  ///< the last sample that has it
  std::int32_t solid = 0;       ///< samples in the solid, r >= 1/2
  std::int32_t read = 0;        ///< samples that were looked at, by whole groups
};

}  // namespace kerf
