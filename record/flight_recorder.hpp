// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <vector>

#include "record/recorder.hpp"
#include "record/tick_log_writer.hpp"

// The flight recorder: the last ticks of a run in memory of constant size, kept on request.

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

/// Keeps the last `options.flight_s` of controller `options.name` in memory until it ends or
/// `stop`. On a fault, a mark, SIGUSR1 or an end of the run that was not requested, it writes them
/// as a recording to `options.out`/TICK-REASON, which appears only when it is complete. The
/// recording can be replayed if the flight recorder saw the run from its first tick: then it also
/// has the inputs before its window (earlier_inputs.hpp), which meanwhile are in
/// `options.out`/.run-NAME. At most `kMostKept` recordings. Throws for bad input. Reports a
/// recording that cannot be written, as on a full disk, in one line, and goes on. Returns the exit
/// code: 0, or 1 after that line again if there was such a recording.
[[nodiscard]] int run_flight_recorder(const RecorderOptions& options,
                                      const std::atomic<bool>& stop);

/// Asks the flight recorder of controller `name` to keep its window, by a mark in the run. Returns
/// the folder of the recording, once that is whole. Throws `SegmentError` if no controller or no
/// flight recorder of that name runs, or if 10 s pass in which it writes none.
[[nodiscard]] std::filesystem::path grab(const std::string& name);

}  // namespace kerf
