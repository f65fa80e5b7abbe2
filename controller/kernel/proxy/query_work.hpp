// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/ball_cap.hpp"
#include "controller/kernel/proxy/contact_closeup.hpp"
#include "controller/kernel/proxy/normal_patch.hpp"
#include "controller/kernel/proxy/proxy_sweep.hpp"

namespace kerf {

/// What the queries of one tool cost in all volumes together, counted in samples that are read. It
/// bounds a tick (`ContactQuery::begin_tick`, docs/theory.md 4.8), and a scene is planned with it.
struct QueryWork {
  /// What a tick may read, 2.5 to 4 ns each, as the machine has it: 38 to 60 us. A head of very
  /// many samples may make kLeastQueries alone.
  static constexpr std::int64_t kTickSamples = 15000;
  static constexpr std::int64_t kLeastQueries = 12;
  static constexpr std::int64_t kLookSamples = 128;  ///< what a look costs besides those it reads
  static constexpr std::int64_t kCloseSamples = 2;   ///< what one of a closeup costs

  /// What a look for a free way costs: each waits for what the last one found.
  static constexpr std::int64_t kFreeLook = 12;
  /// What it costs to see whether a group is in free space. Without it the costliest tick of an
  /// inverted cone with a handpiece takes 98 us, not 66 (rows `ticks`).
  static constexpr std::int64_t kGroupLook = 2;
  /// What it costs to see whether any voxel near a sample reaches the iso.
  static constexpr std::int64_t kNearLook = 27;

  std::int64_t query = 0;   ///< one query at most: all samples in every volume
  std::int64_t closer = 0;  ///< its closer looks at most
  std::int64_t turn = 0;    ///< to place all samples anew
  std::int64_t head = 0;    ///< query and turn of the head alone; 0: there is nothing behind it
  std::int64_t near = 0;    ///< of a query, which begins whether or not the tick has so much left

  /// Of a head, or of it and a part behind, and one more part. `closer` is that of the head and one
  /// part: a query needs no more to begin.
  [[nodiscard]] friend constexpr QueryWork operator+(const QueryWork& a,
                                                     const QueryWork& b) noexcept {
    const bool more = a.head > 0;
    return {a.query + b.query, more ? a.closer : a.closer + b.closer, a.turn + b.turn,
            more ? a.head : a.query + a.turn, a.near + b.near};
  }
  /// Of a tick. No query goes beyond it but the first after a turn, which then has no closer look.
  [[nodiscard]] constexpr std::int64_t budget() const noexcept {
    return std::max(kTickSamples, kLeastQueries * (head > 0 ? head : query + turn));
  }
  /// Once so much of it went into free ways that led nowhere, no group looks for one.
  [[nodiscard]] constexpr std::int64_t most_wasted() const noexcept { return budget() / 8; }
  /// No tick of a sweep reads more: the budget, and one query after the turns, whose last ones may
  /// reach into the move's half. A tool of few samples runs out of queries before.
  [[nodiscard]] constexpr std::int64_t most() const noexcept {
    const std::int64_t after = 8 * (query + closer) > budget() ? turn + query : 0;
    return std::min(budget() + after + 2 * near, SweepRules::kMaxQueries * (query + closer + near) +
                                                     (SweepRules::kMaxTurnQueries + 1) * turn);
  }
};

/// The work of a tool with this point shell. Its closer looks are a ball's cap (ball_cap.hpp), or a
/// closeup (contact_closeup.hpp) and two patches (normal_patch.hpp) of another shape.
template <class N>
[[nodiscard]] constexpr QueryWork query_work(const PointTable<N>& point_shell,
                                             std::size_t volumes) noexcept {
  using Work = QueryWork;
  const std::int64_t cap = Work::kLookSamples + kCapSamples;
  const std::int64_t closeup = Work::kLookSamples + Work::kCloseSamples * kMostClose;
  const std::int64_t patch = Work::kLookSamples + kPatchSamples;
  const std::int64_t query = std::int64_t{point_shell.groups} * kPointGroup + Work::kLookSamples;
  const auto times = static_cast<std::int64_t>(volumes);
  return {.query = times * query,
          .closer = times * (point_shell.round ? cap : closeup + 2 * patch),
          .turn = times * (point_shell.count / 8),
          .near = times * Work::kNearLook};
}

}  // namespace kerf
