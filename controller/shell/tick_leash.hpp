// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace kerf {

/// Lock-step, in which a run takes no time, waits here for whoever must see certain ticks: pictures
/// are spread over the run, and show the same ticks each time. Another process writes into a FIFO
/// how far the servo may go, as u64 of this machine; the last one counts. Virtual time only: it
/// waits.
class TickLeash {
 public:
  /// Throws std::runtime_error with one line where `fifo` is none. Outlived by `stop`.
  TickLeash(const std::string& fifo, const std::atomic<bool>& stop);
  ~TickLeash();
  TickLeash(const TickLeash&) = delete;
  TickLeash& operator=(const TickLeash&) = delete;

  /// Returns once `tick` is allowed, or the loop is to stop. A writer that has gone, or that says
  /// nothing for `kPatienceMs`, lets all later ticks pass.
  void wait_for(std::uint64_t tick) noexcept;

  static constexpr int kPatienceMs = 10'000;

 private:
  int fd_;
  const std::atomic<bool>& stop_;
  std::uint64_t allowed_ = 0;
};

}  // namespace kerf
