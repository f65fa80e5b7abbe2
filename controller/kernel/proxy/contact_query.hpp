// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/free_way.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/closer_look.hpp"
#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/query_work.hpp"
#include "controller/kernel/proxy/ramp_middle.hpp"
#include "controller/kernel/proxy/sample_reader.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"

namespace kerf {

/// Collision queries of one tool against the solid volumes of a scene: the ContactField of the
/// sweep.
///
/// Call `turn` first, then any number of queries with this orientation; a tool that does not turn
/// needs it once. A query reads the samples of the point shell in every volume, but for those in
/// free space. Near rest it takes a closer look (docs/theory.md 3.5): at a ball's cap, or at
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
      : points_(points),
        reader_(kernels, points),
        volumes_(volumes),
        work_(query_work(points.table, volumes.size())) {}

  /// Orients the tool in all queries from now on.
  void turn(const ToolTurn<N>& turn) noexcept {
    reader_.turn(rows_of(turn));
    turned_ = true;
    reader_.spend(work_.turn);
    for (const ContactVolume<N>& volume : volumes_) {
      reader_.place(points_, reader_.rows(), volume.frame, volume.places);
    }
  }

  /// Begins the budget of one tick. Before the first call nothing is counted.
  void begin_tick() noexcept {
    reader_.set_left(work_.budget());
    nearest_ = 0;
    wasted_ = 0;
  }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }
  /// See ContactField.
  [[nodiscard]] bool half_spent() const noexcept { return left() <= work_.budget() / 2; }
  [[nodiscard]] bool may_query() const noexcept { return left() >= work_.query + work_.closer; }
  /// Work that is left of the tick. Parts of one tool hand one account on (tool_query.hpp).
  [[nodiscard]] std::int64_t left() const noexcept { return reader_.left(); }
  void set_left(std::int64_t left) noexcept { reader_.set_left(left); }
  /// Work of the tick for free ways that led nowhere; the same account.
  [[nodiscard]] std::int64_t wasted() const noexcept { return wasted_; }
  void set_wasted(std::int64_t wasted) noexcept { wasted_ = wasted; }
  /// Work since `begin_tick`, in the samples of `work`.
  [[nodiscard]] std::int64_t spent() const noexcept { return work_.budget() - left(); }

  /// What the tool feels with its centre at `q`: at most one plane a volume, the deepest three. Of
  /// volumes that share a face the deepest plane counts.
  [[nodiscard]] Contacts<N> query(ContactVec<Real> q) const noexcept {
    Contacts<N> felt;
    const bool closer = may_query();
    felt.buried = !closer && !turned_;
    return felt.buried ? felt : look(q, closer);
  }

  /// Whether the work is left for a look at `q` with closer looks. What is near is counted where
  /// there is none for the costliest one.
  [[nodiscard]] bool may_look_closely(ContactVec<Real> q) const noexcept {
    if (may_query()) return true;
    std::int64_t cost = work_.closer;
    for (const ContactVolume<N>& volume : volumes_) {
      cost += QueryWork::kLookSamples + reader_.samples_near(volume, Reader::place_of(volume, q));
    }
    return left() >= cost;
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
      const VoxelVec<Real> at = Reader::place_of(volume, q);
      return point_sample<N>(volume.field, {Reader::number_of(at.x), Reader::number_of(at.y),
                                            Reader::number_of(at.z)})
                 .density >= Reader::kIsoDensity;
    });
  }

  /// How far along `move` the centre may go from `q` and feel nothing: a lower bound. The tool goes
  /// as one sphere about its centre, which is all of a ball, and then by the spheres of its groups.
  /// One more query is left. What groups have looked at in vain is bounded by
  /// `QueryWork::most_wasted`.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move) const noexcept {
    return free_distance(q, move, left() - work_.query - work_.closer, work_.most_wasted());
  }
  /// The same by `work` at most, and by groups up to this much in vain.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move, std::int64_t work,
                                   std::int64_t most_wasted) const noexcept {
    const Real length = norm(move);
    if (!(length > Real(SweepRules::kStep))) return Real(0);
    const PointTable<N>& table = points_.table;
    const bool as_one = table.round && table.needed_whole <= kFreeFarthest;
    const std::int64_t spare = std::max<std::int64_t>(work, 0) / QueryWork::kFreeLook;
    std::int64_t looks = spare;
    MoveShare<N> share = kWholeMove<N>;
    for (const ContactVolume<N>& volume : volumes_) {
      const VoxelVec<Real> at = Reader::place_of(volume, q),
                           by = volume.frame.voxel_from_contact * move;
      // No edge of a voxel is shorter than a unit.
      const FreeWay<N> way(
          volume.field.free,
          {Reader::number_of(by.x), Reader::number_of(by.y), Reader::number_of(by.z)},
          Reader::number_of(length));
      const PointNumber<N> centre[3] = {Reader::number_of(at.x), Reader::number_of(at.y),
                                        Reader::number_of(at.z)};
      const MoveShare<N> most = share;
      share = way.free_up_to(centre, table.needed_whole, 0, most, looks);
      if (as_one || wasted_ >= most_wasted) continue;
      share = free_share_of_groups(table, volume.places, centre, way, share, most, nearest_, looks);
    }
    Real free{};
    if constexpr (N::kIsFixed) {
      free = Real::from_raw(static_cast<std::int32_t>(length.raw() * share >> 30));
    } else {
      free = length * share;
    }
    const std::int64_t looked = QueryWork::kFreeLook * (spare - looks);
    reader_.spend(looked);
    if (free <= Real(SweepRules::kStep)) wasted_ += looked;
    return free;
  }

 private:
  using Reader = SampleReader<N>;

  /// Adds this volume's plane, after a closer look where it is near rest; the deepest stand first.
  void feel(const ContactVolume<N>& volume, ContactVec<Real> q, bool closer,
            Contacts<N>& felt) const noexcept {
    const VoxelVec<Real> at = Reader::place_of(volume, q);
    const Real margin = points_.reach + Real(1);
    const auto near = [&](Real x, std::int32_t n) { return x > -margin && x < Real(n) + margin; };
    const VoxelGrid& grid = volume.field.grid;
    if (!near(at.x, grid.nx) || !near(at.y, grid.ny) || !near(at.z, grid.nz)) return;

    const PointSums<N> sums = reader_.sums_at(volume.field, points_.table, volume.places, at);
    if (sums.weight <= typename N::Sum(0)) return;
    ConstraintPlane<N> plane = plane_at(volume, at, sums, closer);
    const bool soft = sums.top < Reader::kIsoDensity;  // what is softer than the iso bears nothing
    if (soft && !reader_.iso_is_near(volume, at, sums.top_sample)) return;
    if (closer) look_midway(volume, q, plane);
    const bool same_all_round = plane.normal == ContactVec<typename N::Unit>{};
    if (same_all_round && soft) return;
    if (same_all_round) {
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
    const auto means =
        point_means<N>(sums, volume.field.scale, volume.frame, reader_.rows(), round);
    ConstraintPlane<N> plane = plane_of<N>(means, points_.reach, round);
    if (closer) CloserLook<N>(reader_, volume, at, sums, means).correct(plane);
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
      const auto middle = ramp_middle<N>([&](Real below) {
        reader_.spend(QueryWork::kFreeLook);
        return Reader::density_at(volume, q + arm - times<N>(plane.normal, below));
      });
      if (middle.level == 0 || !may_query()) return;
      seen.field.scale = density_scale(middle.level);
      const VoxelVec<Real> at = Reader::place_of(volume, q - times<N>(plane.normal, middle.below));
      const PointSums<N> sums = reader_.sums_at(seen.field, points_.table, volume.places, at);
      if (sums.weight <= typename N::Sum(0)) return;
      const ConstraintPlane<N> found = plane_at(seen, at, sums, true);
      const Unit alike = dot(found.normal, plane.normal);
      if (alike <= Unit(0)) return;
      plane.normal = found.normal;
      plane.arm = found.arm;
      if (alike > Unit(kMidwayAlike)) return;
    }
  }

  const PointShell<N>& points_;
  Reader reader_;
  std::span<const ContactVolume<N>> volumes_;
  QueryWork work_;
  mutable bool turned_ = false;       ///< and not queried since
  mutable std::int32_t nearest_ = 0;  ///< group that stopped the last free way
  mutable std::int64_t wasted_ = 0;
};

}  // namespace kerf
