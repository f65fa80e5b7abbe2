// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/free_path.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/contact_refinement.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/kernel/proxy/sample_reader.hpp"

// Collision queries of a tool: of its head alone, and of a head with shaft and handpiece.

namespace kerf {

/// Collision queries of one tool against the solid volumes of a scene: the ContactField of the
/// sweep.
///
/// Call `turn` first, then any number of queries with this orientation; a tool that does not turn
/// needs it once. A query reads the samples of the point shell in every volume, except for those in
/// free space. Near rest it adds a closer look (docs/theory.md 3.5): at the cap of a ball, or at
/// the close samples of another tool and a patch of the volume. In fixed all kernels give the same
/// bits. Servo thread; no heap.
///
/// The work of a tick is counted in samples (`query_work`), since a query among noise or soft
/// tissue costs twice that of one at a face. Once the budget of `begin_tick` is spent, queries
/// return `buried` without reading, and a sweep stays at its last position. The first query after a
/// turn is always answered.
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
  void turn(const Orientation<N>& turn) noexcept {
    reader_.turn(rows_of(turn));
    turned_ = true;
    reader_.spend(work_.turn);
    for (const ContactVolume<N>& volume : volumes_) {
      reader_.place(points_, reader_.rows(), volume.frame, volume.places);
    }
  }

  /// Starts the budget of one tick. Before the first call there is no limit.
  void begin_tick() noexcept {
    reader_.set_left(work_.budget());
    nearest_ = 0;
    wasted_ = 0;
  }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }
  /// See ContactField.
  [[nodiscard]] bool half_spent() const noexcept { return left() <= work_.budget() / 2; }
  [[nodiscard]] bool may_query() const noexcept { return left() >= work_.query + work_.closer; }
  /// Work that is left of the tick. The parts of one tool share one account (`ToolQuery`).
  [[nodiscard]] std::int64_t left() const noexcept { return reader_.left(); }
  void set_left(std::int64_t left) noexcept { reader_.set_left(left); }
  /// Work of the tick for fruitless marches through free space; the same account.
  [[nodiscard]] std::int64_t wasted() const noexcept { return wasted_; }
  void set_wasted(std::int64_t wasted) noexcept { wasted_ = wasted; }
  /// Work since `begin_tick`, in the samples of `work`.
  [[nodiscard]] std::int64_t spent() const noexcept { return work_.budget() - left(); }

  /// Contacts of the tool with its centre at `q`: at most one plane a volume, the deepest three. Of
  /// volumes that share a face the deepest plane counts.
  [[nodiscard]] Contacts<N> query(ContactVec<Real> q) const noexcept {
    Contacts<N> felt;
    const bool closer = may_query();
    felt.buried = !closer && !turned_;
    return felt.buried ? felt : look(q, closer);
  }

  /// Whether enough work is left for a query at `q` with closer looks. If there is not enough for
  /// the costliest one, counts the samples that are near.
  [[nodiscard]] bool may_refine(ContactVec<Real> q) const noexcept {
    if (may_query()) return true;
    std::int64_t cost = work_.closer;
    for (const ContactVolume<N>& volume : volumes_) {
      cost += QueryWork::kQueryOverhead + reader_.samples_near(volume, Reader::place_of(volume, q));
    }
    return left() >= cost;
  }

  /// The same, with closer looks or without, whatever the budget allows.
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

  /// Lower bound of the distance along `move` that the centre may go from `q` without contact.
  /// Tests the tool as one sphere about its centre, which is enough for a ball, then the spheres of
  /// its groups. Leaves the work for one more query. Fruitless work of groups is bounded by
  /// `QueryWork::most_wasted`.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move) const noexcept {
    return free_distance(q, move, left() - work_.query - work_.closer, work_.most_wasted());
  }
  /// The same with at most `work`, and at most `most_wasted` of it fruitless.
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
      const FreePath<N> way(
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

  /// Adds the plane of this volume, after a closer look if it is near rest; the deepest come first.
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
    const bool soft = sums.top < Reader::kIsoDensity;  // below the iso it bears no load
    if (soft && !reader_.iso_is_near(volume, at, sums.top_sample)) return;
    if (closer) refine_at_mid_ramp(volume, q, plane);
    const bool same_all_round = plane.normal == ContactVec<typename N::Unit>{};
    if (same_all_round && soft) return;
    if (same_all_round) {
      felt.buried = true;
      felt.depth = std::max(felt.depth, plane.depth);
      return;
    }
    insert(felt, plane);
  }

  /// The plane of these sums, after a closer look if it is near rest.
  [[nodiscard]] ConstraintPlane<N> plane_at(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                            const PointSums<N>& sums, bool closer) const noexcept {
    const bool round = points_.table.round;
    const auto means =
        point_means<N>(sums, volume.field.scale, volume.frame, reader_.rows(), round);
    ConstraintPlane<N> plane = plane_of<N>(means, points_.reach, round);
    if (closer) ContactRefinement<N>(reader_, volume, at, sums, means).correct(plane);
    return plane;
  }

  /// Normal and position of a contact whose iso is near an end of its face's ramp, from the ramp's
  /// middle (contact_refinement.hpp). The depth stays that of the iso.
  void refine_at_mid_ramp(const ContactVolume<N>& volume, ContactVec<Real> q,
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
  mutable std::int32_t nearest_ = 0;  ///< group that stopped the last march
  mutable std::int64_t wasted_ = 0;
};

/// Most parts behind a head: shaft and handpiece.
inline constexpr std::size_t kMaxShaftParts = 2;

/// A part of a tool behind its head: it has contact and cuts nothing. It has a point shell of its
/// own about its own middle, so that the head keeps the accuracy of its own reach, and planes of
/// its own.
template <class N>
struct ShaftPart {
  PointShell<N> point_shell;
  typename N::Real up{};  ///< from the tool's centre to the part's, along the shaft, units
};

/// All parts of one tool behind its head; none without a shaft.
template <class N>
struct ShaftParts {
  std::size_t count = 0;
  std::array<ShaftPart<N>, kMaxShaftParts> part{};
};

/// Cost of the queries of a whole tool.
template <class N>
[[nodiscard]] constexpr QueryWork query_work(const PointShell<N>& head, const ShaftParts<N>& behind,
                                             std::size_t volumes) noexcept {
  QueryWork work = query_work(head.table, volumes);
  for (std::size_t i = 0; i < behind.count; ++i) {
    work = work + query_work(behind.part[i].point_shell.table, volumes);
  }
  return work;
}

/// Collision queries of a tool with a shaft: the ContactField of the sweep (docs/theory.md 3.7).
///
/// A query is one of each part at the same pose; their planes are merged like those of several
/// volumes: the deepest three stay. Planes of the parts behind are marked. One budget serves all
/// parts. A query begins only if the work of the last one is left, and returns `buried` if a part
/// has more samples near it than is left; the first one after a turn is answered without closer
/// looks then. The tool rotates, whatever its head; the samples of a ball stay, so its contact is
/// the same as without a shaft. Servo thread; no heap.
template <class N>
class ToolQuery {
  using Real = typename N::Real;

 public:
  /// The volumes of a part: the same for all parts, each with positions of its own.
  using Volumes = std::span<const ContactVolume<N>>;

  /// `behind` has at least one part.
  ToolQuery(const KernelSet& kernels, const PointShell<N>& head, Volumes volumes,
            const ShaftParts<N>& behind,
            const std::array<Volumes, kMaxShaftParts>& volumes_behind) noexcept
      : round_(head.table.round),
        head_(kernels, head, volumes),
        shaft_{{kernels, behind.part[0].point_shell, volumes_behind[0]}, behind.part[0].up},
        work_(query_work(head, behind, volumes.size())) {
    if (behind.count > 1) {
      handpiece_.emplace(
          Part{{kernels, behind.part[1].point_shell, volumes_behind[1]}, behind.part[1].up});
    }
    if (round_) head_.turn({});
    begin_tick();
  }

  void turn(const Orientation<N>& turn) noexcept {
    if (!round_) {
      on_account(head_, [&](ContactQuery<N>& head) { head.turn(turn); });
    }
    const RotationRows<N> rows = rows_of(turn);
    each_behind([&](Part& part) {
      on_account(part.query, [&](ContactQuery<N>& query) { query.turn(turn); });
      part.from_head = times<N>({rows[0][1], rows[1][1], rows[2][1]}, part.up);
    });
    turned_ = true;
  }

  void begin_tick() noexcept {
    left_ = work_.budget();
    wasted_ = 0;
    last_ = 0;
    head_.begin_tick();
    each_behind([](Part& part) { part.query.begin_tick(); });
  }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }
  [[nodiscard]] bool half_spent() const noexcept { return left_ <= work_.budget() / 2; }
  /// Whether the work of the last query is left, and that of the costliest one of the head.
  [[nodiscard]] bool may_query() const noexcept {
    return left_ >= std::max(last_, head_.work().query + head_.work().closer);
  }
  [[nodiscard]] std::int64_t spent() const noexcept { return work_.budget() - left_; }

  [[nodiscard]] Contacts<N> query(ContactVec<Real> q) noexcept {
    Contacts<N> felt;
    const bool closer = may_query(), answered = turned_;
    felt.buried = !closer && !answered;
    if (felt.buried) return felt;
    turned_ = false;
    const std::int64_t before = left_;
    bool short_of_work = false;  // for closer looks at all parts
    on_account(head_, [&](const ContactQuery<N>& head) { felt = head.look(q, closer); });
    each_behind([&](Part& part) {
      Contacts<N> seen;
      on_account(part.query, [&](const ContactQuery<N>& query) {
        const ContactVec<Real> at = q + part.from_head;
        short_of_work = closer && (short_of_work || !query.may_refine(at));
        seen.buried = short_of_work && !answered;
        if (!seen.buried) seen = query.look(at, closer && !short_of_work);
      });
      for (std::size_t i = 0; i < static_cast<std::size_t>(seen.count); ++i) {
        ConstraintPlane<N> plane = seen.plane[i];
        plane.arm = plane.arm + part.from_head;
        plane.behind = true;
        insert(felt, plane);
      }
      felt.buried = felt.buried || seen.buried;
      felt.depth = std::max(felt.depth, seen.depth);
    });
    last_ = short_of_work && !answered ? std::numeric_limits<std::int64_t>::max() : before - left_;
    return felt;
  }

  [[nodiscard]] bool is_solid(ContactVec<Real> q) const noexcept { return head_.is_solid(q); }

  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move) noexcept {
    Real free = norm(move);
    const auto look = [&](ContactQuery<N>& part, ContactVec<Real> at) {
      const std::int64_t work = left_ - work_.query - work_.closer;
      on_account(part, [&](const ContactQuery<N>& query) {
        free = std::min(free, query.free_distance(at, move, work, work_.most_wasted()));
      });
    };
    look(head_, q);
    each_behind([&](Part& part) { look(part.query, q + part.from_head); });
    return free;
  }

 private:
  struct Part {
    ContactQuery<N> query;
    Real up{};
    ContactVec<Real> from_head{};  ///< `up` along the rotated shaft
  };

  /// Runs `work` of a part on the account of the whole tool.
  template <class Work>
  void on_account(ContactQuery<N>& part, Work&& work) noexcept {
    part.set_left(left_);
    part.set_wasted(wasted_);
    work(part);
    left_ = part.left();
    wasted_ = part.wasted();
  }
  template <class Visit>
  void each_behind(Visit visit) noexcept {
    visit(shaft_);
    if (handpiece_) visit(*handpiece_);
  }

  bool round_;
  ContactQuery<N> head_;
  Part shaft_;
  std::optional<Part> handpiece_;
  QueryWork work_;
  std::int64_t left_ = 0;    ///< of the tick's samples
  std::int64_t last_ = 0;    ///< work of the last query; the maximum: it was given up
  std::int64_t wasted_ = 0;  ///< for fruitless marches through free space
  bool turned_ = false;      ///< and not queried since
};

}  // namespace kerf
