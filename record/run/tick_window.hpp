// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "record/tick_log_writer.hpp"
#include "shared/segment/layout.hpp"

// The memory of a flight recorder: the last ticks of a run, and what in them is a reason to keep
// them.

namespace kerf {

/// Recordings of one flight recorder.
inline constexpr int kMostKept = 100;

/// The newest ticks, at most `capacity` of them, of each arm. Allocates once.
class TickWindow final : public TickSink {
 public:
  explicit TickWindow(std::size_t capacity, std::size_t arms = 1)
      : rows_(capacity), second_(arms > 1 ? capacity : 0) {}

  void append_second(const TickRecord& record) override;
  void append(const TickRecord& record) override;

  /// Ticks that it holds at most.
  [[nodiscard]] std::size_t capacity() const noexcept { return rows_.size(); }
  /// Rows so far: row `i` of all is there if `first() <= i < end()`.
  [[nodiscard]] std::uint64_t end() const noexcept { return end_; }
  [[nodiscard]] std::uint64_t first() const noexcept {
    return end_ - (end_ < rows_.size() ? end_ : rows_.size());
  }
  [[nodiscard]] const TickRecord& operator[](std::uint64_t i) const noexcept {
    return rows_[i % rows_.size()];
  }
  /// The second arm's row of the same tick; with two arms only.
  [[nodiscard]] const TickRecord& second(std::uint64_t i) const noexcept {
    return second_[i % second_.size()];
  }

  /// The oldest event that was not taken yet and is a reason to keep the window: the begin of a
  /// fault of any arm, or a mark; and its tick. The reason is empty if there is none. At most
  /// `kMostKept` wait; later ones are dropped.
  struct Event {
    std::string reason;
    Tick tick = 0;
  };
  [[nodiscard]] Event take_event();

 private:
  void look_for_fault(const TickRecord& record, std::size_t arm);
  void add_event(std::string reason, Tick tick);

  std::vector<TickRecord> rows_, second_;
  std::uint64_t end_ = 0;
  std::array<std::uint32_t, kMaxArms> faults_{};  // of each arm
  std::deque<Event> events_;
};

}  // namespace kerf
