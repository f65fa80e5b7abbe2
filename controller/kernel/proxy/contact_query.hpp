// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/free_way.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/ball_cap.hpp"
#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_closeup.hpp"
#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/normal_patch.hpp"
#include "controller/kernel/proxy/query_work.hpp"
#include "controller/kernel/proxy/ramp_middle.hpp"
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
  void begin_tick() noexcept {
    left_ = work_.budget();
    nearest_ = 0;
    in_vain_ = 0;
  }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }
  /// See ContactField.
  [[nodiscard]] bool half_spent() const noexcept { return left_ <= work_.budget() / 2; }
  [[nodiscard]] bool may_query() const noexcept { return left_ >= work_.query + work_.closer; }
  /// Work that is left of the tick. Parts of one tool hand one account on (tool_query.hpp).
  [[nodiscard]] std::int64_t left() const noexcept { return left_; }
  void set_left(std::int64_t left) noexcept { left_ = left; }
  /// Work since `begin_tick`, in the samples of `work`.
  [[nodiscard]] std::int64_t spent() const noexcept { return work_.budget() - left_; }

  /// What the tool feels with its centre at `q`: at most one plane a volume, the deepest three. Of
  /// volumes that share a face the deepest plane counts.
  [[nodiscard]] Contacts<N> query(ContactVec<Real> q) const noexcept {
    Contacts<N> felt;
    const bool closer = may_query();
    felt.buried = !closer && !turned_;
    return felt.buried ? felt : look(q, closer);
  }

  /// The same, with closer looks or without, whatever the tick's work allows.
  [[nodiscard]] Contacts<N> look(ContactVec<Real> q, bool closer) const noexcept {
    Contacts<N> felt;
    turned_ = false;
    for (const ContactVolume<N>& volume : volumes_) feel(volume, q, closer, felt);
    if (felt.count > 0) felt.depth = std::max(felt.depth, felt.plane[0].depth);
    return felt;
  }

  /// Whether a volume's density at `q` reaches its iso.
  [[nodiscard]] bool is_solid(ContactVec<Real> q) const noexcept {
    return std::any_of(volumes_.begin(), volumes_.end(), [&](const ContactVolume<N>& volume) {
      const VoxelVec<Real> at = place_of(volume, q);
      return point_sample<N>(volume.field, {number_of(at.x), number_of(at.y), number_of(at.z)})
                 .density >= kIsoDensity;
    });
  }

  /// How far along `move` the centre may go from `q` and feel nothing: a lower bound. The tool goes
  /// as one sphere about its centre, which is all of a ball, and then by the spheres of its groups.
  /// One more query is left. What groups have looked at in vain is bounded by `QueryWork::in_vain`.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move) const noexcept {
    return free_distance(q, move, left_ - work_.query - work_.closer);
  }
  /// The same by `work` at most.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move,
                                   std::int64_t work) const noexcept {
    const Real length = norm(move);
    if (!(length > Real(SweepRules::kStep))) return Real(0);
    const PointTable<N>& table = points_.table;
    const bool as_one = table.round && table.needed_whole <= kFreeFarthest;
    const std::int64_t spare = std::max<std::int64_t>(work, 0) / QueryWork::kFreeLook;
    std::int64_t looks = spare;
    MoveShare<N> share = kWholeMove<N>;
    for (const ContactVolume<N>& volume : volumes_) {
      const VoxelVec<Real> at = place_of(volume, q), by = volume.frame.voxel_from_contact * move;
      // No edge of a voxel is shorter than a unit.
      const FreeWay<N> way(volume.field.free, {number_of(by.x), number_of(by.y), number_of(by.z)},
                           number_of(length));
      const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
      const MoveShare<N> most = share;
      share = way.free_up_to(centre, table.needed_whole, 0, most, looks);
      if (as_one || in_vain_ >= work_.in_vain()) continue;
      share = free_share_of_groups(table, volume.places, centre, way, share, most, nearest_, looks);
    }
    Real free{};
    if constexpr (N::kIsFixed) {
      free = Real::from_raw(static_cast<std::int32_t>(length.raw() * share >> 30));
    } else {
      free = length * share;
    }
    const std::int64_t looked = QueryWork::kFreeLook * (spare - looks);
    left_ -= looked;
    if (free <= Real(SweepRules::kStep)) in_vain_ += looked;
    return free;
  }

 private:
  static constexpr auto kIsoDensity = N::kIsFixed ? PointNumber<N>(1 << 14) : PointNumber<N>(0.5);

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
    ConstraintPlane<N> plane = plane_at(volume, at, sums, closer);
    if (plane.depth > Real(0) && sums.top < kIsoDensity &&
        !iso_is_near(volume, at, sums.top_sample)) {
      return;
    }
    if (closer) look_midway(volume, q, plane);
    // Nearly all samples are in the solid, or the tool feels the same all round. What is softer
    // than the iso bears nothing.
    const ContactVec<typename N::Unit> none{};
    const bool immersed = sums.solid >= points_.table.count - points_.table.count / 16;
    if (!immersed && plane.normal == none && sums.top < kIsoDensity) return;
    if (immersed || plane.normal == none) {
      felt.buried = true;
      felt.depth = std::max(felt.depth, plane.depth);
      return;
    }
    insert(felt, plane);
  }

  /// The plane of these sums, after a closer look where it is near rest.
  [[nodiscard]] ConstraintPlane<N> plane_at(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                            const PointSums<N>& sums, bool closer) const noexcept {
    const bool round = points_.table.round;
    const auto means = point_means<N>(sums, volume.field.scale, volume.frame, rows_, round);
    ConstraintPlane<N> plane = plane_of<N>(means, points_.reach, round);
    if (!closer) return plane;
    if (round && plane.depth < Real(kCapBelow) && -plane.depth < Real(kCapAbove)) {
      plane.depth = depth_around(volume, at, sums, means, plane);
    } else if (!round && std::max(plane.depth, -plane.depth) < Real(kCloseDepth)) {
      look_again(volume, at, sums, means, plane);
    }
    return plane;
  }

  /// Normal and place of a contact whose iso is near an end of its face's ramp, from the ramp's
  /// middle (ramp_middle.hpp). The depth stays that of the iso.
  void look_midway(const ContactVolume<N>& volume, ContactVec<Real> q,
                   ConstraintPlane<N>& plane) const noexcept {
    using Unit = typename N::Unit;
    if (is_midway(volume.field.scale)) return;
    ContactVolume<N> seen = volume;
    for (int look = 0; look < kMidwayLooks; ++look) {
      if (plane.normal == ContactVec<Unit>{} || !may_query()) return;
      const auto arm = points_.table.round ? times<N>(-plane.normal, points_.reach) : plane.arm;
      const auto middle = ramp_middle<N>(
          [&](Real below) { return density_at(volume, q + arm - times<N>(plane.normal, below)); });
      if (middle.level == 0) return;
      seen.field.scale = density_scale(middle.level);
      const VoxelVec<Real> at = place_of(volume, q - times<N>(plane.normal, middle.below));
      const PointSums<N> sums = sums_at(seen.field, points_.table, volume.places, at);
      if (sums.weight <= typename N::Sum(0)) return;
      const ConstraintPlane<N> found = plane_at(seen, at, sums, true);
      const Unit alike = dot(found.normal, plane.normal);
      if (alike <= Unit(0)) return;
      plane.normal = found.normal;
      plane.arm = found.arm;
      if (alike > Unit(kMidwayAlike)) return;
    }
  }

  /// Whether a voxel near a sample reaches the iso: where none does, no summit between the samples
  /// does (docs/theory.md 3.2).
  [[nodiscard]] bool iso_is_near(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                 std::int32_t sample) const noexcept {
    constexpr std::int32_t kNear = 3;  // voxels: the reach of a closeup, and its cell
    left_ -= kNear * kNear * kNear;    // a sample has eight voxels
    const VoxelGrid& grid = volume.field.grid;
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    const std::int32_t end[3] = {grid.nx, grid.ny, grid.nz};
    std::int32_t from[3] = {}, to[3] = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const PointNumber<N> place = centre[axis] + volume.places.offset_vox[axis][sample];
      const auto low = static_cast<std::int32_t>(N::kIsFixed ? place / 65536 : place);
      from[axis] = std::max(low - kNear + 1, 0);
      to[axis] = std::min(low + kNear + 1, end[axis]);
    }
    const DensityScale& scale = volume.field.scale;
    for (std::int32_t z = from[2]; z < to[2]; ++z) {
      for (std::int32_t y = from[1]; y < to[1]; ++y) {
        for (std::int32_t x = from[0]; x < to[0]; ++x) {
          const std::uint64_t density = volume.field.density[grid.index(x, y, z)];
          if ((density * scale.mantissa >> scale.shift) >= 32768) return true;
        }
      }
    }
    return false;
  }

  /// A volume's own density at a place, 0 to 1.
  [[nodiscard]] static Real density_at(const ContactVolume<N>& volume,
                                       ContactVec<Real> place) noexcept {
    DensityField plain = volume.field;
    plain.scale = {};
    const VoxelVec<Real> at = place_of(volume, place);
    const auto density =
        point_sample<N>(plain, {number_of(at.x), number_of(at.y), number_of(at.z)}).density;
    if constexpr (N::kIsFixed) {
      return Real::from_raw(density * 2);
    } else {
      return density;
    }
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
  mutable std::int32_t nearest_ = 0;  ///< group that stopped the last free way
  mutable std::int64_t in_vain_ = 0;  ///< work of the tick for free ways that led nowhere
};

}  // namespace kerf
