// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/loop/real_time.hpp"
#include "controller/servo/servo.hpp"
#include "shared/numeric/statistics.hpp"

namespace kerf {

/// The first events of a run, in order, and the count of all. Fixed memory.
struct EventList {
  struct Event {
    std::uint64_t tick = 0;  ///< as in the segment and in the log
    const char* name = "";
  };

  void add(std::uint64_t tick, const char* name) noexcept {
    if (count < kMax) first[count] = {tick, name};
    ++count;
  }
  [[nodiscard]] std::span<const Event> kept() const noexcept {
    return std::span(first).first(std::min(count, kMax));
  }

  static constexpr std::size_t kMax = 64;
  std::array<Event, kMax> first{};
  std::size_t count = 0;  ///< may exceed kMax
};

/// Bits of `ServoOutput::forbidden_materials`.
inline constexpr std::size_t kMostForbidden = 64;

/// Statistics of a run. Fixed memory: the servo thread writes it, others read it after the end.
struct RunRecord {
  std::uint64_t ticks = 0;          ///< servo steps after arming; the counters below count these
  std::uint64_t armed_at_tick = 0;  ///< tick of the segment and of the log that was the first
  std::uint64_t overruns = 0;
  std::uint64_t stale_ticks = 0;
  std::uint64_t contact_ticks = 0;
  std::uint64_t shaft_ticks = 0;  ///< shaft or handpiece touched
  Histogram wake, compute, publish;
  double peak_force_n = 0;
  std::int64_t first_force_ns = 0;  ///< time of the first sent force, CLOCK_MONOTONIC; 0: none
  std::array<std::uint64_t, kMaxVolumes> removed_steps{};       ///< by volume, since the last reset
  std::array<std::uint64_t, kMostForbidden> forbidden_ticks{};  ///< by material, since then too
  std::uint64_t resets = 0;    ///< of the volumes; before arming too
  std::uint64_t undos = 0;     ///< of the last stroke each
  std::uint64_t redos = 0;     ///< likewise
  double absorbed_mj = 0;      ///< at the device port, + is taken from the hand
  double port_minimum_mj = 0;  ///< lowest value of it: below 0 the loop gave more than it took
  std::array<double, kEnergySources> energy_mj{};  ///< it by source
  std::uint64_t output_hash = 0;
  std::uint64_t allocations = 0;
  ThreadFaults faults_of_pages;

  EventList faults;  ///< as they latched; one makes the run a failure
  EventList events;  ///< of the loop; the run went on after each

  void add_event(std::uint64_t tick, const char* name) noexcept { events.add(tick, name); }
  void add_fault(std::uint64_t tick, const char* name) noexcept { faults.add(tick, name); }
};

}  // namespace kerf
