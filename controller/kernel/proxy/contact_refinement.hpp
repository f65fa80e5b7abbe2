// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/closeup.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/kernel/proxy/sample_reader.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/volume/voxel_grid.hpp"

// Corrects the plane of a contact near rest: by a refinement with more samples, and by a query at
// the middle of a face's ramp.

namespace kerf {

/// Refinement of a contact with one volume near rest (docs/theory.md 3.5). It reads the cap of a
/// ball, or the close samples of another tool and a patch of the volume, and corrects the plane
/// from the point shell. It is valid during one query, with the tool's centre at `at`.
template <class N>
class ContactRefinement {
 public:
  using Real = typename N::Real;

  ContactRefinement(const SampleReader<N>& reader, const ContactVolume<N>& volume,
                    VoxelVec<Real> at, const PointSums<N>& sums,
                    const PointMeans<N>& means) noexcept
      : reader_(reader),
        points_(reader.points()),
        volume_(volume),
        at_(at),
        sums_(sums),
        means_(means) {}

  /// Corrects `plane` if it is near enough to rest.
  void correct(ConstraintPlane<N>& plane) const noexcept {
    if (points_.table.round) {
      plane.depth = depth_around(plane);
    } else if (std::max(plane.depth, -plane.depth) < Real(kCloseDepth)) {
      refine_shape(plane);
    }
  }

 private:
  /// Corrects the plane of a tool that is not a ball: by the close samples around the peak, then by
  /// a patch of the volume around the position that they find. The normal is that of the smoother
  /// of the two surfaces.
  void refine_shape(ConstraintPlane<N>& plane) const noexcept {
    if (points_.close.first == nullptr) return;
    using Unit = typename N::Unit;
    using Ratio = typename N::Ratio;
    PointNumber<N> peak[3] = {};
    peak_offset(sums_, fall_of(means_, false), peak);
    const Closeup<N> seen = reader_.closeup_at(volume_, at_, peak);
    // If the tool touches at two positions, the peak from two means may be at neither of them.
    if (seen.height <= Ratio(0)) return;
    const auto offset = turned_offset<N>(seen.offset, reader_.rows());
    const ContactVec<Real> lever{multiply<Real>(offset.x, points_.reach),
                                 multiply<Real>(offset.y, points_.reach),
                                 multiply<Real>(offset.z, points_.reach)};
    const VoxelVec<Real> middle = at_ + volume_.frame.voxel_from_contact * lever;
    // The first patch is inclined, as its normal is that of the middle.
    Patch<N> patch = patch_at(middle, plane.normal);
    patch = patch_at(middle, direction<N>(-patch.gradient));
    const auto& gradient = patch.gradient;
    const auto facing = direction<N>(-gradient);
    // If the tool's own gradient is far less than that of the patch, it touches faces with other
    // normals.
    const Ratio steep = norm(gradient);
    if (steep < Ratio(0.01)) return;
    const Ratio along = -(multiply<Ratio>(means_.gradient.x, facing.x) +
                          multiply<Ratio>(means_.gradient.y, facing.y) +
                          multiply<Ratio>(means_.gradient.z, facing.z));
    const Unit facing_share(std::clamp(along / steep, Ratio(0), Ratio(1)));
    const Unit alike = Unit(1) - falling_ramp<N>(facing_share, kAlike, kUnlike);
    // Then the depth of the point shell is used, limited from below by the refined depth less
    // `less`: otherwise a step from an allowed position could end beyond the middle of the thinnest
    // wall (docs/theory.md 4.2). The refined depth uses the slope of its face, because in the
    // tool's own gradient the faces cancel.
    const auto less = static_cast<Real>(1 - SweepRules::kStep - SweepRules::kWedged);
    const Ratio own = peak_height(means_, false), highest = std::max(seen.height, means_.top),
                slope = slope_along(means_, plane.normal, false);
    plane.depth = std::max(depth_of<N>(own + multiply<Ratio>(alike, highest - own), slope),
                           depth_of<N>(highest, std::max(slope, slope_of_face(steep))) - less);
    const Unit counts = alike * narrowness<N>(sums_, means_.top);
    plane.lever = plane.lever + part_of<N>(lever - plane.lever, counts);
    const auto own_normal = direction<N>(-turned_offset<N>(seen.normal, reader_.rows()));
    const auto smoother = between<N>(facing, own_normal, smoothness<N>(seen.spread, patch.spread));
    plane.normal = between<N>(plane.normal, smoother, counts);
  }

  /// The patch around `middle`, flattened along `normal`.
  [[nodiscard]] Patch<N> patch_at(VoxelVec<Real> middle,
                                  ContactVec<typename N::Unit> normal) const noexcept {
    constexpr PointShell<N> kPatch{kPatchArrays<N>.table(), {}, Real(kPatchRadius), 15};
    SpiralPlaces<N, kPatchSamples> memory;
    const PointPositions<N> places = memory.places();
    const RotationRows<N> rows = flattened<N>(normal);
    reader_.place(kPatch, rows, volume_.frame, places);
    const PointSums<N> patch = reader_.sums_at(volume_.field, kPatch.table, places, middle);
    if (patch.weight <= typename N::Sum(0)) return {};
    return patch_of<N>(point_means<N>(patch, volume_.field.scale, volume_.frame, rows, false),
                       normal);
  }

  /// Depth of a ball by its cap around the middle of the contact, weighted by the sharpness of the
  /// contact.
  [[nodiscard]] Real depth_around(const ConstraintPlane<N>& plane) const noexcept {
    using Ratio = typename N::Ratio;
    using Unit = typename N::Unit;
    const Ratio height = peak_height(means_, true), slope = slope_along(means_, plane.normal, true);
    const Unit sharp = sharpness(sums_, points_.table.count, height, slope, points_.reach);
    const auto out = direction<N>(means_.offset);
    if (sharp <= Unit(0) || out == decltype(out){}) return plane.depth;
    const PointMeans<N> cap = cap_means(out);
    if (cap.density <= Ratio(0)) return plane.depth;
    const Ratio summit = peak_height(cap, false);
    return depth_of<N>(height + multiply<Ratio>(sharp, summit - height), slope) +
           multiply<Real>(sharp, Real(kSummitAbove));
  }

  /// Means over a cap in the direction `out` from a ball's centre; 0 if there is no density.
  [[nodiscard]] PointMeans<N> cap_means(ContactVec<typename N::Unit> out) const noexcept {
    const Real half = multiply<Real>(points_.reach, typename N::Unit(0.5));
    const Real radius = std::min(Real(kCapRadius), half);
    const PointShell<N> cap{kCapArrays<N>.table(), {}, radius, 14};
    SpiralPlaces<N, kCapSamples> memory;
    const PointPositions<N> places = memory.places();
    const RotationRows<N> rows = cap_rows<N>(out, radius, points_.reach);
    reader_.place(cap, rows, volume_.frame, places);
    const VoxelVec<Real> top =
        at_ + volume_.frame.voxel_from_contact * times<N>(out, points_.reach);
    const PointSums<N> sums = reader_.sums_at(volume_.field, cap.table, places, top);
    if (sums.weight <= typename N::Sum(0)) return {};
    return point_means<N>(sums, volume_.field.scale, volume_.frame, rows, false);
  }

  const SampleReader<N>& reader_;
  const PointShell<N>& points_;
  const ContactVolume<N>& volume_;
  VoxelVec<Real> at_;
  const PointSums<N>& sums_;
  const PointMeans<N>& means_;
};

/// A contact reads only the density between air and the iso-surface: of a face that rises over two
/// units a layer of 2 iso units. At an iso of 0.05 that is a tenth of a unit, where about five
/// samples touch and the gradient of a cell is that of the ramp's bend. Near 1 they read the bend
/// at the other end of the ramp. The surfaces of equal density of one face have the same normals,
/// so normal and position are read at half density (docs/theory.md 3.8).
///
/// Between these fractions of full density the iso-surface is near enough to the middle: the normal
/// is as good there, and nothing more is read. In teeth density goes on changing below the face,
/// which makes the middle rough: with a limit of 0.42 the force steps by 3.5 instead of 0.9 % on
/// the GE tooth of 8 bits, iso 0.34 (rows `cutting`).
inline constexpr double kMidwayFrom = 0.32, kMidwayTo = 0.6;
/// Range of the search for the middle to each side, units. It is at most one unit below the
/// iso-surface, and reads raise a surface of low iso by up to 0.6 more.
inline constexpr double kMidwayFarthest = 1.6;
inline constexpr int kMidRampQueries = 2;       ///< the second along the normal of the first,
inline constexpr double kMidwayAlike = 0.9998;  ///< if it is rotated by more than a degree; cosine

[[nodiscard]] constexpr bool is_midway(const DensityScale& scale) noexcept {
  const double full_over_two_iso = scale_factor<double>(scale);
  return 2 * kMidwayFrom * full_over_two_iso < 1 && 2 * kMidwayTo * full_over_two_iso > 1;
}

/// The middle of a face's ramp.
template <class N>
struct RampMiddle {
  typename N::Real below{};  ///< its distance below the contact, units
  Density level = 0;         ///< the density there; 0: no face
};

/// Searches from a contact on for half of the highest density at 1 and 2.5 units below: there a
/// wall of two units has its middle, and a thick one its full density, although reads raise its
/// surface. On a ramp of two units density rises by `half` per unit, so the first step finds it,
/// except for the bend; the shorter steps after it also suit steeper ramps. `density(below)` is 0
/// to 1.
template <class N, class DensityBelow>
[[nodiscard]] constexpr RampMiddle<N> ramp_middle(const DensityBelow& density) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  const Real half = multiply<Real>(std::max(density(Real(1)), density(Real(2.5))), Unit(0.5));
  if (half < Real(0.002)) return {};  // too few steps of density
  Real below{}, level = density(below);
  for (const double share : {1.0, 0.75, 0.75}) {
    const Real missing = (half - level) / half;
    below = std::clamp(below + multiply<Real>(missing, Unit(share)), Real(-kMidwayFarthest),
                       Real(kMidwayFarthest));
    level = density(below);
  }
  level = std::max(level, multiply<Real>(half, Unit(0.5)));
  if constexpr (N::kIsFixed) {
    return {below, static_cast<Density>(level.raw())};
  } else {
    return {below, static_cast<Density>(level * Real(kDensityMax))};
  }
}

}  // namespace kerf
