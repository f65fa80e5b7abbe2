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

/// What the queries of a tool cost in all volumes together, counted in samples that are read. The
/// servo allows a tick so much (`ContactQuery::begin_tick`), and a scene is planned with it.
struct QueryWork {
  /// A tick's, some 2.5 ns each. A tool of very many samples is allowed some queries of all of
  /// them.
  static constexpr std::int64_t kTickSamples = 18000;
  static constexpr std::int64_t kLeastQueries = 12;
  static constexpr std::int64_t kLookSamples = 128;  ///< what a look costs besides those it reads
  static constexpr std::int64_t kCloseSamples = 2;   ///< what one of a closeup costs

  std::int64_t query = 0;   ///< at most: all of the surface in every volume
  std::int64_t closer = 0;  ///< at most, after that: closer looks
  std::int64_t turn = 0;    ///< to place all samples anew

  /// No query begins in a tick that might go beyond, but for the first after a turn, which then is
  /// without a closer look.
  [[nodiscard]] constexpr std::int64_t budget() const noexcept {
    return std::max(kTickSamples, kLeastQueries * (query + turn));
  }
  /// Of any tick of a sweep: the budget, and the look after the turns where their last queries may
  /// take of the half that is the move's. A sweep of few samples ends before, with
  /// the last query that it may take.
  [[nodiscard]] constexpr std::int64_t most() const noexcept {
    constexpr std::int64_t kTurns = SweepRules::kMaxTurnQueries + 1;
    const std::int64_t after = 8 * (query + closer) > budget() ? turn + query : 0;
    return std::min(budget() + after, SweepRules::kMaxQueries * (query + closer) + kTurns * turn);
  }
};

/// A closer look is at a ball's two caps (ball_cap.hpp), or twice at the close samples of another
/// shape (contact_closeup.hpp) and twice at a patch (normal_patch.hpp).
template <class N>
[[nodiscard]] constexpr QueryWork query_work(const PointTable<N>& shell,
                                             std::size_t volumes) noexcept {
  constexpr std::int64_t kLook = QueryWork::kLookSamples;
  constexpr std::int64_t kCloseup = kLook + QueryWork::kCloseSamples * kMostClose;
  const std::int64_t closer = shell.round ? 2 * kLook + kCapSamples + kSummitSamples
                                          : 2 * kCloseup + 2 * (kLook + kPatchSamples);
  const std::int64_t query = std::int64_t{shell.groups} * kPointGroup + kLook;
  const auto times = static_cast<std::int64_t>(volumes);
  return {times * query, times * closer, times * (shell.count / 8)};
}

}  // namespace kerf
