// SPDX-License-Identifier: Apache-2.0
#include "record/recorder.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace kerf {

Recorder::Recorder(const SegmentReader& reader, TickSink& sink) : reader_(reader), sink_(sink) {
  next_ = oldest();
  // The segment of a run on another machine may hold less than its ring.
  while (read_next() == ReadState::overrun) ++next_;
  losses_.missed_before_start = next_;
}

Recorder::Recorder(const SegmentReader& reader, TickSink& sink, std::uint64_t next,
                   RecordLosses losses)
    : reader_(reader), sink_(sink), next_(next), losses_(std::move(losses)) {}

std::uint64_t Recorder::oldest() const noexcept {
  const std::uint64_t head = reader_.state_head();
  return head - std::min<std::uint64_t>(head, reader_.info().state_slots);
}

ReadState Recorder::read_next() noexcept {
  const ReadState state = reader_.state_at(next_, first_);
  if (state != ReadState::ok || reader_.info().arms == 1) return state;
  return reader_.state_at(next_, second_, 1);
}

std::uint64_t Recorder::poll() {
  const std::uint64_t head = reader_.state_head();
  std::uint64_t appended = 0;
  largest_lag_ = std::max(largest_lag_, head - std::min(next_, head));
  while (next_ < head) {
    const ReadState state = read_next();
    if (state == ReadState::busy || state == ReadState::not_yet) break;
    if (state == ReadState::ok) {
      if (reader_.info().arms > 1) sink_.append_second(second_);
      sink_.append(first_);
      ++appended;
      ++next_;
    } else {
      // The oldest record may be overwritten meanwhile: then the next round skips further.
      skip_to(std::max(next_ + 1, oldest()));
    }
  }
  sink_.flush();
  return appended;
}

void Recorder::drain() {
  poll();
  for (const std::uint64_t head = reader_.state_head(); next_ < head; poll()) skip_to(next_ + 1);
}

void Recorder::skip_to(std::uint64_t index) {
  const std::uint64_t count = index - next_;
  losses_.lost += count;
  std::vector<RecordGap>& gaps = losses_.gaps;
  if (!gaps.empty() && gaps.back().first_index + gaps.back().count == next_) {
    gaps.back().count += count;
  } else if (gaps.size() < kMaxGaps) {
    gaps.push_back({next_, count});
  }
  next_ = index;
}

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kConnectPeriod = std::chrono::milliseconds(50);

[[nodiscard]] bool is_final(Lifecycle lifecycle) noexcept {
  return lifecycle == Lifecycle::clean_end || lifecycle == Lifecycle::fault;
}

}  // namespace

SegmentConnection connect_within(const std::string& name, double wait_s,
                                 const std::atomic<bool>& stop) {
  static_cast<void>(segment_socket(name));  // refuses an impossible name without a wait
  const auto deadline = Clock::now() + std::chrono::duration<double>(wait_s);
  for (;;) {
    try {
      return connect_segment(name);
    } catch (const SegmentAbsent&) {
      if (stop || Clock::now() >= deadline) throw;
    }
    std::this_thread::sleep_for(kConnectPeriod);
  }
}

bool has_ended(const SegmentConnection& connection) noexcept {
  return is_final(connection.reader().lifecycle()) || !connection.alive();
}

std::string_view end_reason(const SegmentReader& reader, bool stopped) noexcept {
  const Lifecycle lifecycle = reader.lifecycle();
  if (lifecycle == Lifecycle::clean_end) return kCleanEnd;
  if (lifecycle == Lifecycle::fault) return kFault;
  return stopped ? "stopped" : "controller gone";
}

}  // namespace kerf
