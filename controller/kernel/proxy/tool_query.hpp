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
#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/query_work.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"

namespace kerf {

/// Most parts behind a head: the shaft, and the handpiece behind it.
inline constexpr std::size_t kMostBehind = 2;

/// A part of a tool behind its head: it is felt and cuts nothing. It has a point shell of its own
/// about its own middle, so the head keeps the accuracy that its own reach gives it, and each has a
/// plane of its own.
template <class N>
struct PartBehind {
  PointShell<N> point_shell;
  typename N::Real up{};  ///< from the tool's centre to the part's, along the shaft, units
};

/// All parts of one tool behind its head; none of a tool without a shaft.
template <class N>
struct PartsBehind {
  std::size_t count = 0;
  std::array<PartBehind<N>, kMostBehind> part{};
};

/// What the queries of a whole tool cost.
template <class N>
[[nodiscard]] constexpr QueryWork query_work(const PointShell<N>& head,
                                             const PartsBehind<N>& behind,
                                             std::size_t volumes) noexcept {
  QueryWork work = query_work(head.table, volumes);
  for (std::size_t i = 0; i < behind.count; ++i) {
    work = work + query_work(behind.part[i].point_shell.table, volumes);
  }
  return work;
}

/// Collision queries of a tool with a shaft: the ContactField of the sweep (docs/theory.md 3.7).
///
/// A query is one of each part at the same pose; what they feel is put together as planes of
/// several volumes are: the deepest three stay. Planes of the parts behind are marked. One budget
/// serves all. A query begins where the work is left that the last one took, and answers `buried`
/// once a part has more near it than is left; the first after a turn is answered without closer
/// looks then. The tool turns, whatever its head; a ball's samples stay as they are, so it feels
/// the same as without a shaft. Servo thread; no heap.
template <class N>
class ToolQuery {
  using Real = typename N::Real;

 public:
  /// The volumes that a part is felt in: the same for all, each with places of its own.
  using Volumes = std::span<const ContactVolume<N>>;

  /// `behind` has a part at least.
  ToolQuery(const KernelSet& kernels, const PointShell<N>& head, Volumes volumes,
            const PartsBehind<N>& behind,
            const std::array<Volumes, kMostBehind>& volumes_behind) noexcept
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

  void turn(const ToolTurn<N>& turn) noexcept {
    if (!round_) {
      on_account(head_, [&](ContactQuery<N>& head) { head.turn(turn); });
    }
    const TurnRows<N> rows = rows_of(turn);
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
  /// No less than the last query took, and what the head's costliest one takes.
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
        short_of_work = closer && (short_of_work || !query.may_look_closely(at));
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
    ContactVec<Real> from_head{};  ///< `up` along the shaft as it is turned
  };

  /// Lets a part work on the account of the whole tool.
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
  std::int64_t last_ = 0;    ///< of them that the last query took; the most: it was given up
  std::int64_t wasted_ = 0;  ///< of them for free ways that led nowhere
  bool turned_ = false;      ///< and not queried since
};

}  // namespace kerf
