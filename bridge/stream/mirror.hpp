// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "bridge/wire/messages.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/replica_writer.hpp"
#include "shared/segment/server.hpp"

namespace kerf::bridge {

/// Converts the other machine's CLOCK_MONOTONIC to the local one. Each counts from its own start,
/// so they may differ by hours. One thread.
///
/// A message that is sent at s (their clock) and arrives at c (ours) took w = c - s - offset >= 0,
/// so the least c - s is the offset plus the shortest delay. As in NTP, that delay is estimated as
/// half of the link's least round trip; the error is half the difference of the two directions.
/// Clocks drift, so the least c - s may grow by `kDriftPpm`.
class ClockOffset {
 public:
  static constexpr std::int64_t kDriftPpm = 100;  ///< of two quartz clocks, 50 each

  /// `round_trip_ns`: the link's least one so far; 0: not known.
  void sample(std::int64_t sent_ns, std::int64_t came_ns, std::int64_t round_trip_ns) noexcept {
    const std::int64_t seen = bounded(came_ns) - bounded(sent_ns);
    const std::int64_t passed =
        std::clamp<std::int64_t>(bounded(came_ns) - last_ns_, 0, kLongestNs);
    least_ns_ = known_ ? std::min(seen, least_ns_ + passed / 1'000'000 * kDriftPpm) : seen;
    // The remainder of the division counts next time.
    last_ns_ = bounded(came_ns) - (known_ ? passed % 1'000'000 : 0);
    if (round_trip_ns > 0) way_ns_ = std::min(way_ns_, bounded(round_trip_ns) / 2);
    known_ = true;
  }

  /// Their time on our clock; never below 0, since a time before our start would wrap.
  [[nodiscard]] std::int64_t local(std::int64_t their_ns) const noexcept {
    const std::int64_t way = way_ns_ == std::numeric_limits<std::int64_t>::max() ? 0 : way_ns_;
    return std::max<std::int64_t>(bounded(their_ns) + least_ns_ - way, 0);
  }
  [[nodiscard]] std::uint64_t local(std::uint64_t their_ns) const noexcept {
    constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    return static_cast<std::uint64_t>(local(static_cast<std::int64_t>(std::min(their_ns, kMost))));
  }

 private:
  static constexpr std::int64_t kLongestNs = std::int64_t{86'400} * 1'000'000'000;  // a day

  /// A time of 73 years at most, so that sums of three stay in 64 bits.
  [[nodiscard]] static constexpr std::int64_t bounded(std::int64_t ns) noexcept {
    constexpr std::int64_t kMost = std::int64_t{1} << 61;
    return std::clamp(ns, -kMost, kMost);
  }

  bool known_ = false;
  std::int64_t least_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::int64_t way_ns_ = std::numeric_limits<std::int64_t>::max();
};

/// One command of a local reader on its way to the other machine and back. The segment server's
/// thread calls `request`; the network's thread calls `take` with each message that arrives, at
/// least 60 times a second, sends the command, and calls `answer`.
class RemoteCommand {
 public:
  /// Without a connection the answer is `busy`, without the right it is `refused`.
  enum class Link : std::uint8_t { down, read_only, open };
  /// A later answer is ignored; a local reader waits for 2 s.
  static constexpr std::chrono::milliseconds kPatience{1500};

  /// Waits for the answer, at most `kPatience`; then returns `busy`, though the command may still
  /// reach the controller.
  [[nodiscard]] Reply request(const Command& command) noexcept;

  /// Network thread: the command to send, once.
  [[nodiscard]] std::optional<CommandMessage> take();
  void answer(const ReplyMessage& reply);
  void set_link(Link link);

 private:
  std::mutex mutex_;
  std::condition_variable answered_;
  Link link_ = Link::down;
  std::uint32_t sequence_ = 0;  // of the last command
  std::optional<CommandMessage> to_send_;
  std::optional<Reply> reply_;  // to the last command
};

/// A message does not match the state of this viewer. The remedy is a new connection: it starts
/// from nothing, and meanwhile readers keep their picture. One line.
struct StreamOutOfSync : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The receiving end of a bridge without its network: messages in, a local segment out.
///
/// The first pass of a run is written directly to a segment that no reader has yet. With its last
/// frame the segment gets the name, and that of an earlier run is removed. Later passes wait in
/// private memory and are published at once when they are complete, so readers always see the state
/// of one tick, however slow the link is. Besides the segment it needs 16 bytes per block, and
/// memory for the present pass.
///
/// One thread, except `Answer`, which the segment server's thread calls.
class Mirror {
 public:
  /// Throws `SegmentError` if `name` cannot be used or another controller has it. A segment of
  /// more than `most_bytes` is refused.
  Mirror(std::string name, std::uint64_t most_bytes, SegmentServer::Answer answer);
  Mirror(const Mirror&) = delete;
  Mirror& operator=(const Mirror&) = delete;
  ~Mirror();

  /// First message of a connection or of a new run. Discards the state of the stream so far. Throws
  /// `WireError` if the message is not valid, `SegmentError` if the run has another layout or is
  /// too large, or if there is no memory.
  const HelloMessage& hello(std::span<const std::byte> message, std::int64_t now_ns,
                            std::int64_t round_trip_ns);

  /// Applies a frame; returns the answer to send. Throws `WireError` or `StreamOutOfSync`, and
  /// `SegmentError` if the name is in use meanwhile.
  AckMessage frame(std::span<const std::byte> message, std::int64_t now_ns,
                   std::int64_t round_trip_ns);

  /// Applies records; ignores those that are not above the last index. Throws `WireError`.
  void records(std::span<const std::byte> message);

  /// True from the first whole pass of a connection until the next greeting.
  [[nodiscard]] bool joined() const noexcept { return joined_; }
  /// True if the controller of the run that is shown has gone.
  [[nodiscard]] bool ended() const noexcept { return ended_; }
  [[nodiscard]] std::uint64_t passes() const noexcept { return passes_; }  ///< published
  /// When the newest published state was read from the other machine's segment, local clock; 0:
  /// nothing is published.
  [[nodiscard]] std::int64_t taken_ns() const noexcept { return taken_ns_; }

 private:
  struct LocalSegment;
  struct Waiting {
    std::uint32_t id;
    std::uint64_t version;
    std::size_t at;  // in the bytes of its frame
  };
  struct Part {  // blocks of one frame that wait for the end of its pass
    std::vector<Waiting> blocks;
    std::vector<std::byte> bytes;
  };

  void take(const FrameParser::Block& block);
  void put(std::uint32_t id, std::uint64_t version, std::span<const std::byte> bytes);
  void publish(const FrameHead& head);

  std::string name_;
  std::uint64_t most_bytes_;
  SegmentServer::Answer answer_;
  ClockOffset clock_;

  // The stream of this connection.
  std::optional<ParsedHello> hello_;
  std::unique_ptr<FrameParser> parser_;
  std::vector<std::uint64_t> held_;  // version per block, 0: not yet
  std::uint32_t blocks_held_ = 0;
  std::uint64_t set_hash_ = 0;
  std::uint64_t last_frame_ = 0;
  std::vector<Part> waiting_;
  std::size_t blocks_waiting_ = 0;
  std::array<std::byte, kMaxRawBytes> scratch_{};

  // What local readers have, and the segment that this connection fills: often the same one.
  std::unique_ptr<LocalSegment> shown_;
  std::unique_ptr<LocalSegment> next_;
  bool joined_ = false;
  bool ended_ = false;
  std::uint64_t passes_ = 0;
  std::int64_t taken_ns_ = 0;
};

}  // namespace kerf::bridge
