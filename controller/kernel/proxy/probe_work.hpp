// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "controller/kernel/proxy/shell_cap.hpp"
#include "controller/kernel/proxy/shell_patch.hpp"
#include "controller/kernel/proxy/shell_table.hpp"

namespace kerf {

/// What the probes of a tool cost in all volumes together, counted in samples that are read. The
/// servo allows a tick so much (`ShellProbe::begin_tick`), and a scene is planned with it.
struct ProbeWork {
  /// A tick's, some 2.5 ns each. A tool of very many samples is allowed some probes of all of them.
  static constexpr std::int64_t kTickSamples = 18000;
  static constexpr std::int64_t kLeastProbes = 12;
  static constexpr std::int64_t kLookSamples = 128;  ///< what a look costs besides those it reads

  std::int64_t probe = 0;  ///< at most: all of the surface, and a closer look in every volume
  std::int64_t turn = 0;   ///< to place all samples anew

  /// After so many in a tick no probe begins, but the one after a turn.
  [[nodiscard]] constexpr std::int64_t budget() const noexcept {
    return std::max(kTickSamples, kLeastProbes * (probe + turn));
  }
  /// Of any tick of a sweep: the budget with the probe that goes beyond it, or all that may be
  /// spent on the turn, with the pushes of its last trial and the look after it. A sweep of few
  /// samples ends before, with the last probe that it may take.
  [[nodiscard]] constexpr std::int64_t most() const noexcept {
    constexpr std::int64_t kTurns = SweepRules::kMaxTurnProbes + 1;
    const std::int64_t turning = (kTurns + 2) * probe + kTurns * turn;
    return std::min(std::max(budget() + probe, turning),
                    SweepRules::kMaxProbes * probe + kTurns * turn);
  }
};

/// A closer look is at a ball's cap (shell_cap.hpp) or the patch of another shape
/// (shell_patch.hpp).
template <class N>
[[nodiscard]] constexpr ProbeWork probe_work(const ShellTable<N>& shell,
                                             std::size_t volumes) noexcept {
  const std::int64_t closer = shell.round ? kCapSamples : kPatchSamples;
  const std::int64_t surface = std::int64_t{shell.groups} * kShellGroup;
  const auto times = static_cast<std::int64_t>(volumes);
  return {times * (surface + closer + 2 * ProbeWork::kLookSamples), times * (shell.count / 8)};
}

}  // namespace kerf
