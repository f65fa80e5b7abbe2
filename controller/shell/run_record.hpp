// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/servo/servo_output.hpp"
#include "controller/shell/real_time.hpp"
#include "shared/numeric/histogram.hpp"

namespace kerf {

/// A fault as it latched, or an event of the shell.
struct FaultEvent {
  std::uint64_t tick = 0;  ///< as in the segment and in the log
  const char* name = "";
  bool fault = false;  ///< it makes the run a failure
};

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
  std::int64_t first_force_ns = 0;  ///< when the first force was sent, CLOCK_MONOTONIC; 0: none was
  std::array<std::uint64_t, kMaxVolumes> removed_steps{};  ///< by volume
  double absorbed_mj = 0;
  std::uint64_t output_hash = 0;
  std::uint64_t allocations = 0;
  ThreadFaults faults_of_pages;

  static constexpr std::size_t kMaxEvents = 64;
  std::array<FaultEvent, kMaxEvents> events{};
  std::size_t event_count = 0;  ///< may exceed kMaxEvents: the first ones are kept
  std::size_t fault_count = 0;  ///< events that make the run a failure

  void add_event(std::uint64_t tick, const char* name) noexcept {
    if (event_count < kMaxEvents) {
      events[event_count].tick = tick;
      events[event_count].name = name;
    }
    ++event_count;
  }
  void add_fault(std::uint64_t tick, const char* name) noexcept {
    if (event_count < kMaxEvents) events[event_count].fault = true;
    add_event(tick, name);
    ++fault_count;
  }
};

}  // namespace kerf
