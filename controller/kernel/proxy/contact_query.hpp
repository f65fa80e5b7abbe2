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

// Collision queries of a tool: of one part of it, and of a head with its shaft and handpiece, if it
// has them.

namespace kerf {

/// Collision queries of one part of a tool against the solid volumes of a scene.
///
/// Call `orient` before the first query; any number of queries with this orientation may follow. A
/// query reads the samples of the point shell in every volume, except for those in free space. With
/// `refined` it adds samples near rest (docs/theory.md 3.5): the cap of a ball, or the close
/// samples of another part and a patch of the volume. In fixed all kernels give the same bits.
/// Servo thread; no heap.
template <class N>
class PartQuery {
 public:
  using Real = typename N::Real;

  /// `kernels` serve fixed point alone. The caller keeps all other arguments.
  PartQuery(const KernelSet& kernels, const PointShell<N>& points,
            std::span<const ContactVolume<N>> volumes, QueryBudget& budget) noexcept
      : points_(points),
        reader_(kernels, points, budget),
        volumes_(volumes),
        work_(query_work(points.table, volumes.size())) {}

  /// Orients the part in all queries from now on.
  void orient(const Orientation<N>& orientation) noexcept {
    reader_.orient(rows_of(orientation));
    budget().spend(work_.orient);
    for (const ContactVolume<N>& volume : volumes_) {
      reader_.place(points_, reader_.rows(), volume.frame, volume.places);
    }
  }

  /// Starts a tick; the budget has its own call.
  void begin_tick() noexcept { nearest_ = 0; }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }

  /// Contacts of the part with its centre at `q`, whatever the budget: at most one plane a volume,
  /// the deepest three. Of volumes that share a face the deepest plane counts.
  [[nodiscard]] Contacts<N> query(ContactVec<Real> q, bool refined) const noexcept {
    Contacts<N> contacts;
    for (const ContactVolume<N>& volume : volumes_) add_plane(volume, q, refined, contacts);
    if (contacts.count > 0) contacts.depth = std::max(contacts.depth, contacts.plane[0].depth);
    return contacts;
  }

  /// Whether enough work is left for the costliest query.
  [[nodiscard]] bool may_query() const noexcept {
    return budget().left() >= work_.query + work_.closer;
  }
  /// Whether enough work is left for a query at `q` with refinement. If there is not enough for
  /// the costliest one, counts the samples that are near.
  [[nodiscard]] bool may_refine(ContactVec<Real> q) const noexcept {
    if (may_query()) return true;
    std::int64_t cost = work_.closer;
    for (const ContactVolume<N>& volume : volumes_) {
      cost += QueryWork::kQueryOverhead +
              reader_.samples_near(volume, Reader::voxel_position(volume, q));
    }
    return budget().left() >= cost;
  }

  /// Whether a volume's density at `q` reaches its iso.
  [[nodiscard]] bool is_solid(ContactVec<Real> q) const noexcept {
    return std::any_of(volumes_.begin(), volumes_.end(), [&](const ContactVolume<N>& volume) {
      const VoxelVec<Real> at = Reader::voxel_position(volume, q);
      return point_sample<N>(volume.field, {Reader::number_of(at.x), Reader::number_of(at.y),
                                            Reader::number_of(at.z)})
                 .density >= Reader::kIsoDensity;
    });
  }

  /// Lower bound of the distance along `move` that the centre may go from `q` without contact.
  /// Tests the part as one sphere about its centre, which is enough for a ball, then the spheres of
  /// its groups. Spends at most `work`; no group is tested once `most_fruitless` is spent in vain.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move, std::int64_t work,
                                   std::int64_t most_fruitless) const noexcept {
    const Real length = norm(move);
    if (!(length > Real(SweepRules::kStep))) return Real(0);
    const PointTable<N>& table = points_.table;
    const bool as_one = table.round && table.needed_whole <= kFreeFarthest;
    const std::int64_t spare = std::max<std::int64_t>(work, 0) / QueryWork::kFreeStep;
    std::int64_t looks = spare;
    MoveShare<N> share = kWholeMove<N>;
    for (const ContactVolume<N>& volume : volumes_) {
      const VoxelVec<Real> at = Reader::voxel_position(volume, q),
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
      if (as_one || budget().fruitless() >= most_fruitless) continue;
      share = free_share_of_groups(table, volume.places, centre, way, share, most, nearest_, looks);
    }
    Real free{};
    if constexpr (N::kIsFixed) {
      free = Real::from_raw(static_cast<std::int32_t>(length.raw() * share >> 30));
    } else {
      free = length * share;
    }
    const std::int64_t looked = QueryWork::kFreeStep * (spare - looks);
    budget().spend(looked);
    if (free <= Real(SweepRules::kStep)) budget().add_fruitless(looked);
    return free;
  }

 private:
  using Reader = SampleReader<N>;

  [[nodiscard]] QueryBudget& budget() const noexcept { return reader_.budget(); }

  /// Adds the plane of this volume, refined if it is near rest; the deepest come first.
  void add_plane(const ContactVolume<N>& volume, ContactVec<Real> q, bool refined,
                 Contacts<N>& contacts) const noexcept {
    const VoxelVec<Real> at = Reader::voxel_position(volume, q);
    const Real margin = points_.reach + Real(1);
    const auto near = [&](Real x, std::int32_t n) { return x > -margin && x < Real(n) + margin; };
    const VoxelGrid& grid = volume.field.grid;
    if (!near(at.x, grid.nx) || !near(at.y, grid.ny) || !near(at.z, grid.nz)) return;

    const PointSums<N> sums = reader_.sums_at(volume.field, points_.table, volume.places, at);
    if (sums.weight <= typename N::Sum(0)) return;
    ConstraintPlane<N> plane = plane_at(volume, at, sums, refined);
    const bool soft = sums.top < Reader::kIsoDensity;  // below the iso it bears no load
    if (soft && !reader_.iso_is_near(volume, at, sums.top_sample)) return;
    if (refined) refine_at_mid_ramp(volume, q, plane);
    const bool same_all_round = plane.normal == ContactVec<typename N::Unit>{};
    if (same_all_round && soft) return;
    if (same_all_round) {
      contacts.no_normal = true;
      contacts.depth = std::max(contacts.depth, plane.depth);
      return;
    }
    insert(contacts, plane);
  }

  /// The plane of these sums, refined if it is near rest.
  [[nodiscard]] ConstraintPlane<N> plane_at(const ContactVolume<N>& volume, VoxelVec<Real> at,
                                            const PointSums<N>& sums, bool refined) const noexcept {
    const bool round = points_.table.round;
    const auto means =
        point_means<N>(sums, volume.field.scale, volume.frame, reader_.rows(), round);
    ConstraintPlane<N> plane = plane_of<N>(means, points_.reach, round);
    if (refined) ContactRefinement<N>(reader_, volume, at, sums, means).correct(plane);
    return plane;
  }

  /// Normal and position of a contact whose iso is near an end of its face's ramp, from the ramp's
  /// middle (contact_refinement.hpp). The depth stays that of the iso.
  void refine_at_mid_ramp(const ContactVolume<N>& volume, ContactVec<Real> q,
                          ConstraintPlane<N>& plane) const noexcept {
    using Unit = typename N::Unit;
    if (is_midway(volume.field.scale)) return;
    ContactVolume<N> seen = volume;
    for (int look = 0; look < kMidRampQueries; ++look) {
      if (plane.normal == ContactVec<Unit>{} || !may_query()) return;
      const auto lever = points_.table.round ? times<N>(-plane.normal, points_.reach) : plane.lever;
      const auto middle = ramp_middle<N>([&](Real below) {
        budget().spend(QueryWork::kFreeStep);
        return Reader::density_at(volume, q + lever - times<N>(plane.normal, below));
      });
      if (middle.level == 0 || !may_query()) return;
      seen.field.scale = density_scale(middle.level);
      const VoxelVec<Real> at =
          Reader::voxel_position(volume, q - times<N>(plane.normal, middle.below));
      const PointSums<N> sums = reader_.sums_at(seen.field, points_.table, volume.places, at);
      if (sums.weight <= typename N::Sum(0)) return;
      const ConstraintPlane<N> found = plane_at(seen, at, sums, true);
      const Unit alike = dot(found.normal, plane.normal);
      if (alike <= Unit(0)) return;
      plane.normal = found.normal;
      plane.lever = found.lever;
      if (alike > Unit(kMidwayAlike)) return;
    }
  }

  const PointShell<N>& points_;
  Reader reader_;
  std::span<const ContactVolume<N>> volumes_;
  QueryWork work_;
  mutable std::int32_t nearest_ = 0;  ///< group that stopped the last march
};

/// Shaft and handpiece.
inline constexpr std::size_t kMaxShaftParts = 2;

/// Shaft or handpiece of a tool: a part with contact that cuts nothing. It has a point shell about
/// its own middle, so that the head keeps the accuracy of its own reach, and planes of its own.
template <class N>
struct ShaftPart {
  PointShell<N> point_shell;
  typename N::Real up{};  ///< from the tool's centre to the part's, along the shaft, units
};

/// Shaft and handpiece of one tool, if it has them.
template <class N>
struct ShaftParts {
  std::size_t count = 0;
  std::array<ShaftPart<N>, kMaxShaftParts> part{};
};

/// Cost of the queries of a whole tool.
template <class N>
[[nodiscard]] constexpr QueryWork query_work(const PointShell<N>& head, const ShaftParts<N>& shaft,
                                             std::size_t volumes) noexcept {
  QueryWork work = query_work(head.table, volumes);
  for (std::size_t i = 0; i < shaft.count; ++i) {
    work = work + query_work(shaft.part[i].point_shell.table, volumes);
  }
  return work;
}

/// Collision queries of a tool, with a shaft or without: the ContactField of the sweep
/// (docs/theory.md 3.7).
///
/// A query is one of each part at the same pose; their planes are merged like those of several
/// volumes: the deepest three stay. Planes of shaft and handpiece are marked. A tool with a shaft
/// has an orientation even if its head is a ball. The samples of a ball head are not rotated, so
/// its contact is the same with and without a shaft.
///
/// The work of a tick is counted in samples (`query_work`), since a query among noise or soft
/// tissue costs twice that of one at a face. One budget serves all parts. Once it is spent, queries
/// return `no_normal` without reading, and a sweep stays at its last position. With a shaft, a
/// query also starts only if the remaining budget covers the cost of the previous query in this
/// tick. It returns `no_normal` if a part has more nearby samples than the budget allows. The first
/// query after a rotation is always answered, but without refinement if the budget is short. Servo
/// thread; no heap.
template <class N>
class ContactQuery {
  using Real = typename N::Real;

 public:
  /// The volumes of a part: the same for all parts, each with positions of its own.
  using Volumes = std::span<const ContactVolume<N>>;

  /// `kernels` serve fixed point alone. The caller keeps all other arguments.
  ContactQuery(const KernelSet& kernels, const PointShell<N>& head, Volumes volumes,
               const ShaftParts<N>& shaft = {},
               const std::array<Volumes, kMaxShaftParts>& shaft_volumes = {}) noexcept
      : work_(query_work(head, shaft, volumes.size())),
        budget_(work_.budget()),
        head_(kernels, head, volumes, budget_),
        shaft_parts_(shaft.count),
        head_turns_(shaft.count == 0 || !head.table.round),
        deficit_(head.deficit) {
    for (std::size_t i = 0; i < shaft_parts_; ++i) {
      const ShaftPart<N>& part = shaft.part[i];
      deficit_ = std::max(deficit_, part.point_shell.deficit);
      part_[i].emplace(Part{
          {kernels, part.point_shell, shaft_volumes[i], budget_}, part.up, ContactVec<Real>{}});
    }
    if (!head_turns_) head_.orient({});
  }
  ContactQuery(const ContactQuery&) = delete;  // its parts point to its budget
  ContactQuery& operator=(const ContactQuery&) = delete;

  /// Orients the tool in all queries from now on; once for a tool that keeps its orientation.
  void orient(const Orientation<N>& orientation) noexcept {
    if (head_turns_) head_.orient(orientation);
    const RotationRows<N> rows = rows_of(orientation);
    each_shaft_part([&](Part& part) {
      part.query.orient(orientation);
      part.from_head = times<N>({rows[0][1], rows[1][1], rows[2][1]}, part.up);
    });
    turned_ = true;
  }

  /// Starts the budget of one tick. Before the first call there is no limit.
  void begin_tick() noexcept {
    budget_.begin_tick();
    last_ = 0;
    head_.begin_tick();
    each_shaft_part([](Part& part) { part.query.begin_tick(); });
  }
  [[nodiscard]] const QueryWork& work() const noexcept { return work_; }
  /// Work since `begin_tick`, in the samples of `work`.
  [[nodiscard]] std::int64_t spent() const noexcept { return budget_.spent(); }
  /// See ContactField.
  [[nodiscard]] bool half_spent() const noexcept { return budget_.half_spent(); }
  /// Whether the remaining budget covers the most expensive query of the head and, with a shaft,
  /// the cost of the previous query in this tick.
  [[nodiscard]] bool may_query() const noexcept {
    return head_.may_query() && budget_.left() >= last_;
  }

  /// See ContactField; the largest of all parts.
  [[nodiscard]] Real deficit() const noexcept { return deficit_; }

  /// Contacts of the tool with the centre of its head at `q`.
  [[nodiscard]] Contacts<N> query(ContactVec<Real> q) noexcept {
    Contacts<N> contacts;
    const bool refined = may_query(), answered = turned_;
    contacts.no_normal = !refined && !answered;
    if (contacts.no_normal) return contacts;
    turned_ = false;
    const std::int64_t before = budget_.left();
    contacts = head_.query(q, refined);
    if (shaft_parts_ == 0) return contacts;
    bool short_of_work = false;  // to refine all parts
    each_shaft_part([&](Part& part) {
      const ContactVec<Real> at = q + part.from_head;
      short_of_work = refined && (short_of_work || !part.query.may_refine(at));
      Contacts<N> of_part;
      of_part.no_normal = short_of_work && !answered;
      if (!of_part.no_normal) of_part = part.query.query(at, refined && !short_of_work);
      for (std::size_t i = 0; i < static_cast<std::size_t>(of_part.count); ++i) {
        ConstraintPlane<N> plane = of_part.plane[i];
        plane.lever = plane.lever + part.from_head;
        plane.on_shaft = true;
        insert(contacts, plane);
      }
      contacts.no_normal = contacts.no_normal || of_part.no_normal;
      contacts.depth = std::max(contacts.depth, of_part.depth);
    });
    last_ = short_of_work && !answered ? std::numeric_limits<std::int64_t>::max()
                                       : before - budget_.left();
    return contacts;
  }

  /// Whether a volume's density at `q` reaches its iso.
  [[nodiscard]] bool is_solid(ContactVec<Real> q) const noexcept { return head_.is_solid(q); }

  /// Lower bound of the distance along `move` that the tool may go from `q` without contact. Leaves
  /// the work for one more query.
  [[nodiscard]] Real free_distance(ContactVec<Real> q, ContactVec<Real> move) noexcept {
    Real free = norm(move);
    const auto shorten = [&](const PartQuery<N>& part, ContactVec<Real> at) {
      const std::int64_t work = budget_.left() - work_.query - work_.closer;
      free = std::min(free, part.free_distance(at, move, work, work_.most_wasted()));
    };
    shorten(head_, q);
    each_shaft_part([&](Part& part) { shorten(part.query, q + part.from_head); });
    return free;
  }

 private:
  struct Part {
    PartQuery<N> query;
    Real up{};
    ContactVec<Real> from_head{};  ///< `up` along the rotated shaft
  };

  template <class Visit>
  void each_shaft_part(Visit visit) noexcept {
    for (std::size_t i = 0; i < shaft_parts_; ++i) visit(*part_[i]);
  }

  QueryWork work_;
  QueryBudget budget_;
  PartQuery<N> head_;
  std::size_t shaft_parts_;
  std::array<std::optional<Part>, kMaxShaftParts> part_;
  bool head_turns_;  ///< whether `orient` rotates the samples of the head
  Real deficit_;
  /// Cost of the previous query with a shaft; INT64_MAX if that query was abandoned.
  std::int64_t last_ = 0;
  bool turned_ = false;  ///< the tool was rotated, and not queried since
};

}  // namespace kerf
