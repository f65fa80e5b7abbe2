// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/threads.hpp"

namespace kerf::test {

/// Times at which somebody who wanted to run did not. One thread writes; to be read after it ended.
class Standstills {
 public:
  static constexpr std::int64_t kWorthNs = 3'000'000;  // several times the period of all involved

  Standstills() { gaps_.reserve(10'000); }
  /// Now it runs.
  void runs(std::int64_t now_ns) {
    const bool is_gap = last_ns_ != 0 && now_ns - last_ns_ > kWorthNs;
    if (is_gap && gaps_.size() < gaps_.capacity()) gaps_.emplace_back(last_ns_, now_ns);
    last_ns_ = now_ns;
  }
  /// The longest that began or ended between these two, in us; 0: none.
  [[nodiscard]] std::int64_t longest_us(std::int64_t from_ns, std::int64_t to_ns) const {
    std::int64_t longest_ns = 0;
    for (const auto& [begin_ns, end_ns] : gaps_) {
      if (begin_ns < to_ns && end_ns > from_ns)
        longest_ns = std::max(longest_ns, end_ns - begin_ns);
    }
    return longest_ns / 1000;
  }

 private:
  std::vector<std::pair<std::int64_t, std::int64_t>> gaps_;
  std::int64_t last_ns_ = 0;
};

/// A thread that only sleeps, beside what is measured. Where it stands still as well, it was the
/// machine: with the highest priority of all on their core, nothing of ours can hold it up.
class StallControl {
 public:
  /// `priority` 0: an ordinary thread.
  StallControl(int core, int priority)
      : thread_([this, core, priority] {
          static_cast<void>(pin_to_core(core));
          if (priority > 0) static_cast<void>(set_fifo(priority));
          while (!stop_) {
            seen_.runs(monotonic_ns());
            sleep_until_ns(monotonic_ns() + kPeriodNs);
          }
        }) {}
  ~StallControl() { stop(); }
  StallControl(const StallControl&) = delete;
  StallControl& operator=(const StallControl&) = delete;

  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] const Standstills& seen() const noexcept { return seen_; }

 private:
  static constexpr std::int64_t kPeriodNs = 1'000'000;
  std::atomic<bool> stop_{false};
  Standstills seen_;
  std::thread thread_;
};

/// Three of them: on the core of what is measured above all of it and below all of it, and above
/// all on another core. A machine that stands still takes all three; one that is busy the ordinary
/// one. Where the first stands still and the ordinary one stood still for 950 ms before, the kernel
/// has taken the core from all real-time threads, because some program of theirs never sleeps.
class StallWatch {
 public:
  /// Only then may the rest be asked.
  void stop() {
    for (StallControl* control : {&above_, &ordinary_, &elsewhere_}) control->stop();
  }
  /// Whether nobody with whatever priority could have run all the time between the two.
  [[nodiscard]] bool core_was_taken(std::int64_t from_ns, std::int64_t to_ns) const {
    return above_.seen().longest_us(from_ns, to_ns) > 0;
  }
  [[nodiscard]] std::string text(std::int64_t from_ns, std::int64_t to_ns) const {
    const auto ms = [&](const StallControl& control) {
      return std::to_string(control.seen().longest_us(from_ns, to_ns) / 1000);
    };
    return "control " + ms(above_) + ", ordinary " + ms(ordinary_) + ", other core " +
           ms(elsewhere_);
  }

 private:
  static constexpr int kPriority = 90;  // above the emulator's
  StallControl above_{allowed_cores().back(), kPriority};
  StallControl ordinary_{allowed_cores().back(), 0};
  StallControl elsewhere_{allowed_cores().front(), kPriority};
};

}  // namespace kerf::test
