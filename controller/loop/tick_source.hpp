// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "controller/device/devices.hpp"
#include "shared/posix/monotonic_clock.hpp"

// Start of ticks: deadlines in real time, reports in lock-step, standstill and the gate of
// `--until`.

namespace kerf {

/// Absolute deadlines on CLOCK_MONOTONIC: lateness never adds up. A deadline that is late by a
/// whole period or more is skipped and counted, never caught up in a burst; one that is late by
/// less is served late.
class DeadlineClock {
 public:
  /// `spin_ns` of each period are spent spinning before the deadline, which removes the timer's
  /// wake-up latency (about 15 us on a virtual machine) for that fraction of one core.
  DeadlineClock(std::int64_t period_ns, std::int64_t spin_ns) noexcept
      : period_ns_(period_ns), spin_ns_(spin_ns), deadline_ns_(monotonic_ns()) {}

  /// Waits for the next deadline and returns the lateness of the wake-up. An interrupted sleep
  /// continues.
  std::int64_t wait_next() noexcept {
    deadline_ns_ += period_ns_;
    std::int64_t now = monotonic_ns();
    if (now >= deadline_ns_ + period_ns_) {
      const std::int64_t missed = (now - deadline_ns_) / period_ns_;
      overruns_ += static_cast<std::uint64_t>(missed);
      deadline_ns_ += missed * period_ns_;
    }
    sleep_until_ns(deadline_ns_ - spin_ns_);
    do now = monotonic_ns();
    while (now < deadline_ns_);
    return now - deadline_ns_;
  }

  [[nodiscard]] std::uint64_t overruns() const noexcept { return overruns_; }

 private:
  std::int64_t period_ns_;
  std::int64_t spin_ns_;
  std::int64_t deadline_ns_;
  std::uint64_t overruns_ = 0;
};

/// Gate of a lock-step run, whose ticks take no time: it waits for processes that must see certain
/// ticks, so that pictures are spread over the run and no tick is missing in its log. Each of them
/// writes the last tick that it allows into a FIFO of its own, as u64 of this machine; the newest
/// one counts. Virtual time only: it blocks.
class TickGate {
 public:
  /// Throws std::runtime_error with one line if one of `fifos` is none. `stop` outlives it.
  TickGate(const std::vector<std::string>& fifos, const std::atomic<bool>& stop) : stop_(stop) {
    for (const std::string& fifo : fifos) {
      leads_.push_back({open(fifo.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)});
      struct stat status {};
      const int fd = leads_.back().fd;
      if (fd >= 0 && fstat(fd, &status) == 0 && S_ISFIFO(status.st_mode)) continue;
      close_all();
      throw std::runtime_error("--until " + fifo + ": no FIFO; make one with mkfifo");
    }
  }
  ~TickGate() { close_all(); }
  TickGate(const TickGate&) = delete;
  TickGate& operator=(const TickGate&) = delete;

  /// Returns once all allow `tick`, or the loop has to stop. If a writer is gone, or writes nothing
  /// for `kPatienceMs`, it allows all later ticks.
  void wait_for(std::uint64_t tick) noexcept {
    for (Lead& lead : leads_) wait_for(lead, tick);
  }

  static constexpr int kPatienceMs = 10'000;

 private:
  struct Lead {
    int fd = -1;
    std::uint64_t allowed = 0;
  };

  void wait_for(Lead& lead, std::uint64_t tick) const noexcept {
    for (int waited_ms = 0; tick > lead.allowed && waited_ms < kPatienceMs;) {
      if (stop_.load(std::memory_order_relaxed)) return;
      pollfd fifo{lead.fd, POLLIN, 0};
      if (poll(&fifo, 1, kLookMs) <= 0) {
        waited_ms += kLookMs;
      } else if (read(lead.fd, &lead.allowed, sizeof lead.allowed) != sizeof lead.allowed) {
        break;  // the writer has gone; eight bytes come whole, or not at all
      }
    }
    if (tick > lead.allowed) lead.allowed = std::numeric_limits<std::uint64_t>::max();
  }

  void close_all() noexcept {
    for (const Lead& lead : leads_) {
      if (lead.fd >= 0) close(lead.fd);
    }
  }

  static constexpr int kLookMs = 100;  ///< period of the checks for a stop request

  std::vector<Lead> leads_;
  const std::atomic<bool>& stop_;
};

/// A servo whose ticks begin so far apart has stood still: its last contact is outdated.
inline constexpr std::int64_t kStandstillNs = 20'000'000;

/// Detects a tick that began kStandstillNs or more after the last one. One thread.
class StandstillWatch {
 public:
  /// Once per tick, at its start.
  [[nodiscard]] bool stood_still(std::int64_t now_ns) noexcept {
    const bool stood_still = began_ns_ > 0 && now_ns - began_ns_ >= kStandstillNs;
    began_ns_ = now_ns;
    return stood_still;
  }

 private:
  std::int64_t began_ns_ = 0;  ///< the last tick; 0: there was none
};

/// Start of a tick: the clock, or in lock-step the next report of the device.
class TickSource {
 public:
  virtual ~TickSource() = default;
  /// Waits for the next tick and returns its lateness in ns.
  virtual std::int64_t wait_next() noexcept = 0;
  /// Deadlines that were skipped because a tick ran over.
  [[nodiscard]] virtual std::uint64_t overruns() const noexcept = 0;
  /// Begin of a tick: CLOCK_MONOTONIC; in lock-step the time of the servo itself, from 0.
  [[nodiscard]] virtual std::int64_t start_ns(std::uint64_t) const noexcept {
    return monotonic_ns();
  }
  /// Whether a tick takes time. In lock-step it takes none: two runs publish the same bytes.
  [[nodiscard]] virtual bool takes_time() const noexcept { return true; }
  /// Whether this tick began kStandstillNs or more after the last one; false without a clock.
  [[nodiscard]] virtual bool stood_still() const noexcept { return false; }
};

/// Real time: absolute deadlines.
class RealTimeTicks final : public TickSource {
 public:
  RealTimeTicks(std::int64_t period_ns, std::int64_t spin_ns) noexcept
      : clock_(period_ns, spin_ns) {}
  std::int64_t wait_next() noexcept override {
    const std::int64_t late_ns = clock_.wait_next();
    stood_still_ = watch_.stood_still(monotonic_ns());
    return late_ns;
  }
  [[nodiscard]] std::uint64_t overruns() const noexcept override { return clock_.overruns(); }
  [[nodiscard]] bool stood_still() const noexcept override { return stood_still_; }

 private:
  DeadlineClock clock_;
  StandstillWatch watch_;
  bool stood_still_ = false;
};

/// Virtual time: one tick per report of each device, as fast as all processes run. After a device
/// has been silent for two seconds of real time, ticks pass without a report of it until the next
/// one comes. With a gate, each tick first waits until the gate allows it.
class LockStepTicks final : public TickSource {
 public:
  LockStepTicks(const Devices& devices, std::int64_t period_ns, TickGate* gate = nullptr) noexcept
      : devices_(devices), period_ns_(period_ns), gate_(gate) {}
  std::int64_t wait_next() noexcept override {
    if (gate_ != nullptr) gate_->wait_for(++tick_);
    for (std::size_t a = 0; a < devices_.size(); ++a) {
      silent_[a] = !devices_[a].wait(silent_[a] ? 0 : kPatienceMs);
    }
    return 0;
  }
  [[nodiscard]] std::uint64_t overruns() const noexcept override { return 0; }
  [[nodiscard]] std::int64_t start_ns(std::uint64_t tick) const noexcept override {
    return static_cast<std::int64_t>(tick) * period_ns_;
  }
  [[nodiscard]] bool takes_time() const noexcept override { return false; }

 private:
  static constexpr int kPatienceMs = 2000;
  Devices devices_;
  std::int64_t period_ns_;
  TickGate* gate_;
  std::uint64_t tick_ = 0;
  std::array<bool, kMaxArms> silent_{};
};

}  // namespace kerf
