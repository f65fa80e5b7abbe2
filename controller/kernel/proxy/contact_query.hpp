// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/ball_cap.hpp"
#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_closeup.hpp"
#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/normal_patch.hpp"
#include "controller/kernel/proxy/query_work.hpp"
#include "controller/kernel/proxy/spiral_points.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"

namespace kerf {

/// A tool as contact sees it: its point shell and, of a shape that is no ball, close samples.
template <class N>
struct PointShell {
  PointTable<N> table;
  CloseTable<N> close;         ///< none of a ball
  typename N::Real reach{};    ///< units from the centre to the farthest sample
  std::int32_t step_bits = 0;  ///< fraction bits of PointStep's rows: reach 2^step_bits < 2^16
};

/// One solid volume, and memory for the tool's places in it, which belongs to the servo.
template <class N>
struct ContactVolume {
  DensityField field;
  ContactFrame<N> frame;
  PointPlaces<N> places;
};

/// Collision queries of one tool against the solid volumes of a scene: the ContactField of the
/// sweep.
///
/// Call `turn` first, then any number of queries with this orientation; a tool that does not turn
/// needs it once. A query reads the samples of the point shell in every volume, but for those in
/// free space. Near rest it takes a closer look (docs/theory.md 3.5): at a ball's two caps, or at
/// another tool's close samples and a patch of the volume. In fixed all kernels give the same bits.
/// Servo thread; no heap.
///
/// A tick's work is counted in samples (`query_work`), since a query among noise or soft tissue
/// costs twice what one at a face does. Once the budget of `begin_tick` is spent, queries answer
/// `buried` without a look, and a sweep stays at its last place. The first query after a turn is
/// always answered.
template <class N>
class ContactQuery {
 public:
  using Real = typename N::Real;

  /// `kernels` serve fixed point alone.
  ContactQuery(const KernelSet& kernels, const PointShell<N>& points,
               std::span<const ContactVolume<N>> volumes) noexcept
      : kernels_(kernels),
        points_(points),
        volumes_(volumes),
        work_(query_work(points.table, volumes.size())) {}

  /// Orients the tool in all queries from now on.
  void turn(const ToolTurn<N>& turn) noexcept {
    rows_ = rows_of(turn);
    turned_ = true;
    left_ -= work_.turn;
    for (const ContactVolume<N>& volume : volumes_) {
      place(points_, rows_, volume.frame, volume.places);
    }
  }

  /// Begins the budget of one tick. Before the first call nothing is counted.
  void begin_tick() noexcept { left_ = work_.budget(); }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }
  /// See ContactField.
  [[nodiscard]] bool half_spent() const noexcept { return left_ <= work_.budget() / 2; }
  [[nodiscard]] bool may_query() const noexcept { return left_ >= work_.query + work_.closer; }
  /// Work since `begin_tick`, in the samples of `work`.
  [[nodiscard]] std::int64_t spent() const noexcept { return work_.budget() - left_; }

  /// What the tool feels with its centre at `q`: at most one plane a volume, the deepest three. Of
  /// volumes that share a face the deepest plane counts.
  [[nodiscard]] Contacts<N> query(ContactVec<Real> q) const noexcept {
    Contacts<N> felt;
    const bool closer = may_query();
    felt.buried = !closer && !turned_;
    if (felt.buried) return felt;
    turned_ = false;
    for (const ContactVolume<N>& volume : volumes_) feel(volume, q, closer, felt);
    if (felt.count > 0) felt.depth = std::max(felt.depth, felt.plane[0].depth);
    return felt;
  }

  /// Whether a volume's density at `q` reaches its iso.
  [[nodiscard]] bool is_solid(ContactVec<Real> q) const noexcept {
    constexpr auto kIso = N::kIsFixed ? PointNumber<N>(1 << 14) : PointNumber<N>(0.5);
    return std::any_of(volumes_.begin(), volumes_.end(), [&](const ContactVolume<N>& volume) {
      const VoxelVec<Real> at = place_of(volume, q);
      return point_sample<N>(volume.field, {number_of(at.x), number_of(at.y), number_of(at.z)})
                 .density >= kIso;
    });
  }

  /// How far the centre may move from `q` in any direction and feel nothing: a lower bound.
  [[nodiscard]] Real free_distance(ContactVec<Real> q) const noexcept {
    // A sample reads one voxel further, and half a unit is for roundings.
    const Real own = points_.reach + Real(1.5);
    Real free(kContactLimit);
    for (const ContactVolume<N>& volume : volumes_) {
      const VoxelVec<Real> at = place_of(volume, q);
      const std::int32_t x = whole(at.x), y = whole(at.y), z = whole(at.z);
      const VoxelGrid& grid = volume.field.grid;
      const auto beyond = [](std::int32_t i, std::int32_t n) { return std::max(-i, i - n + 1); };
      const std::int32_t outside =
          std::max({beyond(x, grid.nx), beyond(y, grid.ny), beyond(z, grid.nz)});
      const std::int32_t bricks = volume.field.free.at(x, y, z);
      // No edge of a voxel is shorter than a unit.
      free = std::min(free, Real(std::max(outside, (bricks - 1) * kFreeBrick)) - own);
    }
    return std::max(free, Real(0));
  }

 private:
  [[nodiscard]] static std::int32_t whole(Real x) noexcept {
    if constexpr (N::kIsFixed) {
      return x.raw() >> Real::kFractionBits;
    } else {
      return static_cast<std::int32_t>(x < Real(0) ? x - Real(1) : x);
    }
  }
  [[nodiscard]] static PointNumber<N> number_of(Real x) noexcept {
    if constexpr (N::kIsFixed) {
      return x.raw();
    } else {
      return x;
    }
  }
  [[nodiscard]] static VoxelVec<Real> place_of(const ContactVolume<N>& volume,
                                               ContactVec<Real> q) noexcept {
    return volume.frame.voxel_from_contact * q + volume.frame.origin_vox;
  }

  /// The matrix that takes a tool's offsets to voxels; `rows` turns them to the world's axes.
  [[nodiscard]] static PointStep<N> step_of(const PointShell<N>& points, const TurnRows<N>& rows,
                                            const ContactFrame<N>& frame) noexcept {
    PointStep<N> step;
    step.shift = 15 + points.step_bits - 16;  // from offsets times rows to Q15.16
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& m = frame.voxel_from_contact.row[i];
      for (std::size_t j = 0; j < 3; ++j) {
        if constexpr (N::kIsFixed) {
          std::int64_t turned = 0;  // Q24 Q30 = Q54, three terms of 2^54
          for (std::size_t k = 0; k < 3; ++k) {
            turned += std::int64_t{m[k].raw()} * rows[k][j].raw();
          }
          // Q30 times a reach in Q16: 2^30 2^22.
          const std::int64_t reached = round_shift(turned, 24) * points.reach.raw();
          step.row[i][j] = static_cast<std::int32_t>(round_shift(reached, 46 - points.step_bits));
        } else {
          step.row[i][j] =
              points.reach * (m[0] * rows[0][j] + m[1] * rows[1][j] + m[2] * rows[2][j]);
        }
      }
    }
    return step;
  }

  void place(const PointShell<N>& points, const TurnRows<N>& rows, const ContactFrame<N>& frame,
             const PointPlaces<N>& places) const noexcept {
    const PointStep<N> step = step_of(points, rows, frame);
    if constexpr (N::kIsFixed) {
      kernels_.place_points(points.table, step, places);
    } else {
      place_points(points.table, step, places);
    }
  }

  /// Adds this volume's plane, after a closer look where it is near rest; the deepest stand first.
  void feel(const ContactVolume<N>& volume, ContactVec<Real> q, bool closer,
            Contacts<N>& felt) const noexcept {
    const VoxelVec<Real> at = place_of(volume, q);
    const Real margin = points_.reach + Real(1);
    const auto near = [&](Real x, std::int32_t n) { return x > -margin && x < Real(n) + margin; };
    const VoxelGrid& grid = volume.field.grid;
    if (!near(at.x, grid.nx) || !near(at.y, grid.ny) || !near(at.z, grid.nz)) return;

    const PointSums<N> sums = sums_at(volume.field, points_.table, volume.places, at);
    if (sums.weight <= typename N::Sum(0)) return;
    const bool round = points_.table.round;
    const auto means = point_means<N>(sums, volume.field.scale, volume.frame, rows_, round);
    ConstraintPlane<N> plane = plane_of<N>(means, points_.reach, round);
    if (closer) {
      if (round && plane.depth < Real(kCapBelow) && -plane.depth < Real(kCapAbove)) {
        plane.depth = depth_around(volume, at, sums, means, plane);
      } else if (!round && std::max(plane.depth, -plane.depth) < Real(kCloseDepth)) {
        look_again(volume, at, sums, means, plane);
      }
    }
    // Nearly all samples are in the solid, or the tool feels the same all round. What is softer
    // than the iso bears nothing.
    const ContactVec<typename N::Unit> none{};
    const bool immersed = sums.solid >= points_.table.count - points_.table.count / 16;
    if (!immersed && plane.normal == none && means.top < typename N::Ratio(0.5)) return;
    if (immersed || plane.normal == none) {
      felt.buried = true;
      felt.depth = std::max(felt.depth, plane.depth);
      return;
    }
    const auto count = static_cast<std::size_t>(felt.count);
    std::size_t slot = 0;  // that the plane takes, in place of one that says the same or is shallow
    while (slot < count && !are_one_face<N>(felt.plane[slot].normal, plane.normal)) ++slot;
    if (slot == kMaxPlanes) --slot;
    if (slot < count && felt.plane[slot].depth >= plane.depth) return;
    if (slot == count) ++felt.count;
    for (; slot > 0 && felt.plane[slot - 1].depth < plane.depth; --slot) {
      felt.plane[slot] = felt.plane[slot - 1];
    }
    felt.plane[slot] = plane;
  }

  /// Corrects the plane of a tool that is no ball: by the close samples around the peak, then by a
  /// patch of the volume around the place that they find.
  void look_again(const ContactVolume<N>& volume, VoxelVec<Real> at, const PointSums<N>& sums,
                  const PointMeans<N>& means, ConstraintPlane<N>& plane) const noexcept {
    if (points_.close.first == nullptr) return;
    using Unit = typename N::Unit;
    using Ratio = typename N::Ratio;
    PointNumber<N> peak[3] = {};
    peak_offset(sums, fall_of(means, false), peak);
    Closeup<N> seen = look_closely_at(volume, at, peak);
    Ratio height = seen.height;
    // If the highest sample of the point shell was not among what was seen, the tool touches twice.
    const auto share = falling_share<N>(Unit(means.top - seen.top), 0.06, 0.02);
    if (share < Unit(1)) {
      const auto top = static_cast<std::size_t>(sums.top_sample);
      const auto& offset = points_.table.offset;
      const Closeup<N> other =
          look_closely_at(volume, at, {offset[0][top], offset[1][top], offset[2][top]});
      height = other.height + multiply<Ratio>(share, height - other.height);
      if (share <= Unit(0)) seen = other;
    }
    const auto offset = turned_offset<N>(seen.offset, rows_);
    const ContactVec<Real> arm{multiply<Real>(offset.x, points_.reach),
                               multiply<Real>(offset.y, points_.reach),
                               multiply<Real>(offset.z, points_.reach)};
    const VoxelVec<Real> middle = at + volume.frame.voxel_from_contact * arm;
    // The first patch lies askew, as its normal is that of the middle.
    auto gradient = patch_gradient(volume, middle, plane.normal);
    gradient = patch_gradient(volume, middle, direction<N>(-gradient));
    const auto normal = direction<N>(-gradient);
    // Where the tool's own gradient is far less than the patch's, it touches faces that look
    // elsewhere.
    const Ratio steep = norm(gradient);
    if (steep < Ratio(0.01)) return;
    const Ratio along = -(multiply<Ratio>(means.gradient.x, normal.x) +
                          multiply<Ratio>(means.gradient.y, normal.y) +
                          multiply<Ratio>(means.gradient.z, normal.z));
    const Unit alike =
        Unit(1) -
        falling_share<N>(Unit(std::clamp(along / steep, Ratio(0), Ratio(1))), kAlike, kUnlike);
    const Ratio own = peak_height(means, false);
    plane.depth = depth_of<N>(own + multiply<Ratio>(alike, std::max(height, means.top) - own),
                              slope_along(means, plane.normal, false));
    const Unit counts = alike * share * narrowness<N>(sums, means.top);
    plane.arm = plane.arm + part_of<N>(arm - plane.arm, counts);
    plane.normal = between<N>(plane.normal, normal, counts);
  }

  [[nodiscard]] Closeup<N> look_closely_at(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                           const PointNumber<N> (&offset)[3]) const noexcept {
    CloseSamples<N> samples;
    samples.take(points_.close, offset);
    const PointTable<N> table = samples.table();
    const PointPlaces<N> places = samples.places();
    const PointStep<N> step = step_of(points_, rows_, volume.frame);
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    CloseSums<N> sums;
    if constexpr (N::kIsFixed) {
      kernels_.place_points(table, step, places);
      kernels_.read_points(places, table.count, centre, volume.field, samples.density.data());
      samples.fade(table);
      kernels_.sum_close(table, samples.density.data(), sums);
    } else {
      place_points(table, step, places);
      read_points<N>(places, table.count, centre, volume.field, samples.density.data());
      samples.fade(table);
      sums = close_sums<N>(table, samples.density.data());
    }
    left_ -= QueryWork::kLookSamples + QueryWork::kCloseSamples * table.count;
    return peak_of(sums);
  }

  /// The mean gradient over a patch that is flattened along `normal`.
  [[nodiscard]] ContactVec<typename N::Ratio> patch_gradient(
      const ContactVolume<N>& volume, VoxelVec<Real> middle,
      ContactVec<typename N::Unit> normal) const noexcept {
    constexpr PointShell<N> kPatch{kPatchArrays<N>.table(), {}, Real(kPatchRadius), 15};
    SpiralPlaces<N, kPatchSamples> memory;
    const PointPlaces<N> places = memory.places();
    place(kPatch, flattened<N>(normal), volume.frame, places);
    const PointSums<N> patch = sums_at(volume.field, kPatch.table, places, middle);
    if (patch.weight <= typename N::Sum(0)) return {};
    return mean_gradient<N>(patch, volume.field.scale, volume.frame);
  }

  /// A ball's depth by its caps around the middle of the contact, as far as the contact is sharp.
  [[nodiscard]] Real depth_around(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                  const PointSums<N>& sums, const PointMeans<N>& means,
                                  const ConstraintPlane<N>& plane) const noexcept {
    using Ratio = typename N::Ratio;
    using Unit = typename N::Unit;
    const Ratio height = peak_height(means, true), slope = slope_along(means, plane.normal, true);
    const Unit sharp = sharpness(sums, points_.table.count, height, slope, points_.reach);
    const auto out = direction<N>(means.offset);
    if (sharp <= Unit(0) || out == decltype(out){}) return plane.depth;
    const Real half = multiply<Real>(points_.reach, Unit(0.5));
    const Real wide = std::min(Real(kCapRadius), half),
               narrow = std::min(Real(kSummitRadius), half);
    const PointMeans<N> found = cap_means(volume, at, out, kCapArrays<N>, wide);
    const Unit share(wide / points_.reach);
    const auto moved = [&](Unit from, Ratio by) {
      return Ratio(from) + multiply<Ratio>(share, by);
    };
    const auto up = direction<N>(ContactVec<Ratio>{
        moved(out.x, found.offset.x), moved(out.y, found.offset.y), moved(out.z, found.offset.z)});
    const PointMeans<N> near = cap_means(volume, at, up, kSummitArrays<N>, narrow);
    if (near.density <= Ratio(0)) return plane.depth;
    const Ratio summit = peak_height(near, false);
    return depth_of<N>(height + multiply<Ratio>(sharp, summit - height), slope) +
           multiply<Real>(sharp, Real(kSummitAbove));
  }

  /// Means over a cap in the direction `out` from a ball's centre; 0 where it feels nothing.
  template <std::size_t kCount>
  [[nodiscard]] PointMeans<N> cap_means(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                        ContactVec<typename N::Unit> out,
                                        const SpiralArrays<N, kCount>& arrays,
                                        Real radius) const noexcept {
    const PointShell<N> cap{arrays.table(), {}, radius, 14};
    SpiralPlaces<N, kCount> memory;
    const PointPlaces<N> places = memory.places();
    const TurnRows<N> rows = cap_rows<N>(out, radius, points_.reach);
    place(cap, rows, volume.frame, places);
    const VoxelVec<Real> top = at + volume.frame.voxel_from_contact * times<N>(out, points_.reach);
    const PointSums<N> sums = sums_at(volume.field, cap.table, places, top);
    if (sums.weight <= typename N::Sum(0)) return {};
    return point_means<N>(sums, volume.field.scale, volume.frame, rows, false);
  }

  [[nodiscard]] PointSums<N> sums_at(const DensityField& field, const PointTable<N>& table,
                                     const PointPlaces<N>& places,
                                     VoxelVec<Real> at) const noexcept {
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    PointSums<N> sums;
    if constexpr (N::kIsFixed) {
      kernels_.sum_points(table, places, centre, field, sums);
    } else {
      sums = point_sums<N>(table, places, centre, field);
    }
    left_ -= QueryWork::kLookSamples + sums.read;
    return sums;
  }

  const KernelSet& kernels_;
  const PointShell<N>& points_;
  std::span<const ContactVolume<N>> volumes_;
  QueryWork work_;
  TurnRows<N> rows_{};
  mutable std::int64_t left_ = std::numeric_limits<std::int64_t>::max();  ///< of the tick's samples
  mutable bool turned_ = false;                                           ///< and not queried since
};

}  // namespace kerf
