// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/closeup.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "shared/numeric/numbers.hpp"

// Reads the samples of a tool in volumes, and counts that work against the budget of a tick.

namespace kerf {

/// Cost of the queries of one tool in all volumes together, counted in samples that are read. It
/// bounds a tick (`QueryBudget`, docs/theory.md 4.8), and a scene is planned with it.
struct QueryWork {
  /// Budget of a tick, 2.5 to 4 ns each, depending on the machine: 38 to 60 us. A head of very many
  /// samples gets the budget of kLeastQueries.
  static constexpr std::int64_t kTickSamples = 15000;
  static constexpr std::int64_t kLeastQueries = 12;
  static constexpr std::int64_t kQueryOverhead = 128;  ///< fixed cost of reading a shell
  static constexpr std::int64_t kCloseSamples = 2;     ///< cost of one sample of a closeup

  /// Cost of one step in the free-space map. Each step needs the result of the last one.
  static constexpr std::int64_t kFreeStep = 12;
  /// Cost of finding whether a group is in free space. Without it the costliest tick of an
  /// inverted cone with a handpiece takes 98 us, not 66 (rows `ticks`).
  static constexpr std::int64_t kGroupTest = 2;
  /// Cost of finding whether a voxel near a sample reaches the iso.
  static constexpr std::int64_t kIsoTest = 27;

  std::int64_t query = 0;   ///< most of one query: all samples in every volume
  std::int64_t closer = 0;  ///< most of its refinements
  std::int64_t orient = 0;  ///< transformation of all samples
  std::int64_t head = 0;    ///< query and orient of the head alone; 0: no shaft
  std::int64_t near = 0;    ///< extra of a query; not required for it to begin

  /// Adds the work of one more part; begins with the head. `query`, `orient` and `near` are sums;
  /// `closer` is that of the head and the first part added, the minimum that a query needs to
  /// begin.
  [[nodiscard]] friend constexpr QueryWork operator+(const QueryWork& a,
                                                     const QueryWork& b) noexcept {
    const bool more = a.head > 0;
    return {a.query + b.query, more ? a.closer : a.closer + b.closer, a.orient + b.orient,
            more ? a.head : a.query + a.orient, a.near + b.near};
  }
  /// Budget of a tick. Only the first query after a rotation may exceed it, and then without
  /// refinement.
  [[nodiscard]] constexpr std::int64_t budget() const noexcept {
    return std::max(kTickSamples, kLeastQueries * (head > 0 ? head : query + orient));
  }
  /// Limit of the work for marches through free space that find no free path. Once it is reached,
  /// no group tries one.
  [[nodiscard]] constexpr std::int64_t most_wasted() const noexcept { return budget() / 8; }
  /// Upper bound of a tick of a sweep: the budget, and one query after the rotations, the last of
  /// which may use work of the move's half. A tool of few samples reaches the limit of queries
  /// first.
  [[nodiscard]] constexpr std::int64_t most() const noexcept {
    const std::int64_t after = 8 * (query + closer) > budget() ? orient + query : 0;
    return std::min(budget() + after + 2 * near,
                    SweepRules::kMaxQueries * (query + closer + near) +
                        (SweepRules::kMaxRotationQueries + 1) * orient);
  }
};

/// The work of a tool with this point shell. Its refinements are the cap of a ball, or a closeup
/// and two patches of another shape (closeup.hpp).
template <class N>
[[nodiscard]] constexpr QueryWork query_work(const PointTable<N>& point_shell,
                                             std::size_t volumes) noexcept {
  using Work = QueryWork;
  const std::int64_t cap = Work::kQueryOverhead + kCapSamples;
  const std::int64_t closeup = Work::kQueryOverhead + Work::kCloseSamples * kMostClose;
  const std::int64_t patch = Work::kQueryOverhead + kPatchSamples;
  const std::int64_t query = std::int64_t{point_shell.groups} * kPointGroup + Work::kQueryOverhead;
  const auto times = static_cast<std::int64_t>(volumes);
  return {.query = times * query,
          .closer = times * (point_shell.round ? cap : closeup + 2 * patch),
          .orient = times * (point_shell.count / 8),
          .near = times * Work::kIsoTest};
}

/// Remaining work of a tick, in the units of `QueryWork`, for all parts of a tool together.
/// Unlimited before the first `begin_tick`. Servo thread.
class QueryBudget {
 public:
  explicit constexpr QueryBudget(std::int64_t whole) noexcept : whole_(whole) {}

  constexpr void begin_tick() noexcept {
    left_ = whole_;
    fruitless_ = 0;
  }
  constexpr void spend(std::int64_t work) noexcept { left_ -= work; }
  /// Counts work of a march through free space that found no free path.
  constexpr void add_fruitless(std::int64_t work) noexcept { fruitless_ += work; }

  [[nodiscard]] constexpr std::int64_t left() const noexcept { return left_; }
  [[nodiscard]] constexpr std::int64_t spent() const noexcept { return whole_ - left_; }
  [[nodiscard]] constexpr bool half_spent() const noexcept { return left_ <= whole_ / 2; }
  [[nodiscard]] constexpr std::int64_t fruitless() const noexcept { return fruitless_; }

 private:
  std::int64_t whole_;
  std::int64_t left_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t fruitless_ = 0;
};

/// The surface of a tool for contact: its point shell and, unless it is a ball, close samples.
template <class N>
struct PointShell {
  PointTable<N> table;
  CloseTable<N> close;         ///< empty for a ball
  typename N::Real reach{};    ///< units from the centre to the farthest sample
  std::int32_t step_bits = 0;  ///< fraction bits of PointStep's rows: reach 2^step_bits < 2^16
  typename N::Real deficit{};  ///< units that the surface reaches beyond its samples, at most
};

/// One solid volume, and memory for the positions of the tool's samples in it, which belongs to the
/// servo.
template <class N>
struct ContactVolume {
  DensityField field;
  ContactFrame<N> frame;
  PointPositions<N> places;
};

/// Reads samples of one part of a tool in solid volumes, and spends the budget of the tick for it.
/// In fixed all kernels give the same bits. Servo thread; no heap.
template <class N>
class SampleReader {
 public:
  using Real = typename N::Real;
  static constexpr auto kIsoDensity = N::kIsFixed ? PointNumber<N>(1 << 14) : PointNumber<N>(0.5);

  /// `kernels` serve fixed point alone.
  constexpr SampleReader(const KernelSet& kernels, const PointShell<N>& points,
                         QueryBudget& budget) noexcept
      : kernels_(kernels), points_(points), budget_(budget) {}

  [[nodiscard]] const PointShell<N>& points() const noexcept { return points_; }
  [[nodiscard]] const RotationRows<N>& rows() const noexcept { return rows_; }
  /// Sets the orientation of the tool; call `place` for each volume after it.
  void orient(const RotationRows<N>& rows) noexcept { rows_ = rows; }

  [[nodiscard]] QueryBudget& budget() const noexcept { return budget_; }

  /// Converts to the number type of point tables.
  [[nodiscard]] static PointNumber<N> number_of(Real x) noexcept {
    if constexpr (N::kIsFixed) {
      return x.raw();
    } else {
      return x;
    }
  }
  /// Converts a position of contact space to voxels of a volume.
  [[nodiscard]] static VoxelVec<Real> voxel_position(const ContactVolume<N>& volume,
                                                     ContactVec<Real> q) noexcept {
    return volume.frame.voxel_from_contact * q + volume.frame.origin_vox;
  }

  /// Transforms samples to voxels of a volume, rotated by `rows`.
  void place(const PointShell<N>& points, const RotationRows<N>& rows, const ContactFrame<N>& frame,
             const PointPositions<N>& places) const noexcept {
    const PointStep<N> step = step_of(points, rows, frame);
    if constexpr (N::kIsFixed) {
      kernels_.transform_points(points.table, step, places);
    } else {
      transform_points(points.table, step, places);
    }
  }

  /// Sums over the samples at `places` around the position `at`.
  [[nodiscard]] PointSums<N> sums_at(const DensityField& field, const PointTable<N>& table,
                                     const PointPositions<N>& places,
                                     VoxelVec<Real> at) const noexcept {
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    PointSums<N> sums;
    if constexpr (N::kIsFixed) {
      kernels_.sum_points(table, places, centre, field, sums);
    } else {
      sums = point_sums<N>(table, places, centre, field);
    }
    budget_.spend(QueryWork::kQueryOverhead + sums.read);
    return sums;
  }

  /// Number of samples that a query of the whole tool at `at` reads: those of all groups that are
  /// not in free space.
  [[nodiscard]] std::int64_t samples_near(const ContactVolume<N>& volume,
                                          VoxelVec<Real> at) const noexcept {
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    budget_.spend(QueryWork::kGroupTest * points_.table.groups);
    std::int64_t near = 0;
    for (std::int32_t group = 0; group < points_.table.groups; ++group) {
      if (!is_free(points_.table, volume.places, centre, volume.field, group)) near += kPointGroup;
    }
    return near;
  }

  /// The peak of the close samples around an offset of the tool, whose centre is at `at`.
  [[nodiscard]] Closeup<N> closeup_at(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                      const PointNumber<N> (&offset)[3]) const noexcept {
    CloseSamples<N> samples;
    samples.take(points_.close, offset);
    const PointTable<N> table = samples.table();
    const PointPositions<N> places = samples.places();
    const PointStep<N> step = step_of(points_, rows_, volume.frame);
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    CloseSums<N> sums;
    if constexpr (N::kIsFixed) {
      kernels_.transform_points(table, step, places);
      kernels_.read_points(places, table.count, centre, volume.field, samples.density.data());
      kernels_.sum_close(samples.fade(table), sums);
    } else {
      transform_points(table, step, places);
      read_points<N>(places, table.count, centre, volume.field, samples.density.data());
      sums = close_sums<N>(samples.fade(table));
    }
    budget_.spend(QueryWork::kQueryOverhead + QueryWork::kCloseSamples * table.count);
    return peak_of(sums);
  }

  /// Whether a voxel near a sample reaches the iso: if none does, no summit between the samples
  /// does (docs/theory.md 3.2).
  [[nodiscard]] bool iso_is_near(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                 std::int32_t sample) const noexcept {
    budget_.spend(QueryWork::kIsoTest);  // a sample has eight voxels
    const VoxelGrid& grid = volume.field.grid;
    const PointNumber<N> centre[3] = {number_of(at.x), number_of(at.y), number_of(at.z)};
    const std::int32_t end[3] = {grid.nx, grid.ny, grid.nz};
    std::int32_t from[3] = {}, to[3] = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto place = place_at<N>(centre[axis], volume.places.offset_vox[axis][sample]);
      const auto low = static_cast<std::int32_t>(N::kIsFixed ? place / 65536 : place);
      from[axis] = std::max(low - kIsoNear + 1, std::int32_t{0});
      to[axis] = std::min(low + kIsoNear + 1, end[axis]);
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

  /// Density of a volume, not scaled by its iso, at a position; 0 to 1.
  [[nodiscard]] static Real density_at(const ContactVolume<N>& volume,
                                       ContactVec<Real> place) noexcept {
    DensityField plain = volume.field;
    plain.scale = {};
    const VoxelVec<Real> at = voxel_position(volume, place);
    const auto density =
        point_sample<N>(plain, {number_of(at.x), number_of(at.y), number_of(at.z)}).density;
    if constexpr (N::kIsFixed) {
      return Real::from_raw(density * 2);
    } else {
      return density;
    }
  }

 private:
  /// The matrix that maps a tool's offsets to voxels; `rows` rotates them to the world's axes.
  [[nodiscard]] static PointStep<N> step_of(const PointShell<N>& points,
                                            const RotationRows<N>& rows,
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

  const KernelSet& kernels_;
  const PointShell<N>& points_;
  RotationRows<N> rows_{};
  QueryBudget& budget_;
};

}  // namespace kerf
