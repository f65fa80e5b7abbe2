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

/// Converts the server's CLOCK_MONOTONIC to the local one. Each counts from the start of its own
/// machine, so they may differ by hours. One thread.
///
/// A message that is sent at s (their clock) and arrives at c (ours) has a delay of c - s - offset,
/// so the least c - s is the offset plus the shortest delay. As in NTP, that delay is estimated as
/// half of the link's least round trip; the error is half the difference between the directions.
/// Clocks drift, so the least c - s may grow by `kDriftPpm`.
class ClockOffset {
 public:
  static constexpr std::int64_t kDriftPpm = 100;  ///< two quartz clocks, 50 ppm each

  /// A message that was sent at `sent_ns` (their clock) arrived at `came_ns` (ours).
  /// `round_trip_ns`: the link's least so far; 0: not known.
  void sample(std::int64_t sent_ns, std::int64_t came_ns, std::int64_t round_trip_ns) noexcept {
    const std::int64_t seen = bounded(came_ns) - bounded(sent_ns);
    const std::int64_t passed =
        std::clamp<std::int64_t>(bounded(came_ns) - last_ns_, 0, kLongestNs);
    least_ns_ = known_ ? std::min(seen, least_ns_ + passed / 1'000'000 * kDriftPpm) : seen;
    // The remainder of the division is carried over to the next sample.
    last_ns_ = bounded(came_ns) - (known_ ? passed % 1'000'000 : 0);
    if (round_trip_ns > 0) way_ns_ = std::min(way_ns_, bounded(round_trip_ns) / 2);
    known_ = true;
  }

  /// Converts a time of theirs to our clock. Never below 0, because a time before the start of our
  /// clock would wrap as unsigned.
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

  /// Clamps a time to +-73 years, so that a sum of three fits in 64 bits.
  [[nodiscard]] static constexpr std::int64_t bounded(std::int64_t ns) noexcept {
    constexpr std::int64_t kMost = std::int64_t{1} << 61;
    return std::clamp(ns, -kMost, kMost);
  }

  bool known_ = false;
  std::int64_t least_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::int64_t way_ns_ = std::numeric_limits<std::int64_t>::max();
};

/// Passes one command at a time from a local reader to the server, and the reply back. The segment
/// server's thread calls `request`. The network thread calls `take` after each message that
/// arrives, at least 60 times a second, sends the command, and calls `answer` with the reply.
class RemoteCommand {
 public:
  /// `down`: the reply is `busy`. `read_only`: no right to command, the reply is `refused`.
  enum class Link : std::uint8_t { down, read_only, open };
  /// Longest wait for the reply; below the 2 s that a local reader waits. A later reply is ignored.
  static constexpr std::chrono::milliseconds kPatience{1500};

  /// Waits for the reply. Returns `busy` after `kPatience`; the command may still reach the
  /// controller.
  [[nodiscard]] Reply request(const SegmentCommand& command) noexcept;

  /// Network thread, as `answer` and `set_link`: a command to send; each is returned once.
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

/// A message does not match the state of this viewer. The remedy is a new connection, which starts
/// from nothing; meanwhile readers keep what they have. One line.
struct StreamOutOfSync : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The receiver of a bridge without the network: messages in, a local segment out.
///
/// The first pass of a run is written directly to a segment that no reader has yet. After its last
/// frame readers can connect to the segment by its name; the segment of an earlier run is then
/// removed. A later pass is collected in private memory and published when it is complete, so that
/// readers see the state of one tick even on a slow link. Besides the segment this needs 16 bytes
/// per block, and memory for the current pass.
///
/// One thread, except `answer`, which the segment server's thread calls.
class Mirror {
 public:
  /// `name`: of the local segment. Throws `SegmentError` if it cannot be used or a controller has
  /// it. A segment of more than `most_bytes` is refused. `answer` handles the commands of local
  /// readers.
  Mirror(std::string name, std::uint64_t most_bytes, SegmentServer::Answer answer);
  Mirror(const Mirror&) = delete;
  Mirror& operator=(const Mirror&) = delete;
  ~Mirror();

  /// First message of a connection or of a new run. Discards the state of the stream so far. Throws
  /// `WireError` if the message is not valid; `SegmentError` if the run has another layout, is too
  /// large, or memory cannot be allocated.
  const HelloMessage& hello(std::span<const std::byte> message, std::int64_t now_ns,
                            std::int64_t round_trip_ns);

  /// Applies a frame; returns the acknowledgement to send. Throws `WireError`, `StreamOutOfSync`,
  /// or `SegmentError` if a controller has taken the name in the meantime.
  AckMessage frame(std::span<const std::byte> message, std::int64_t now_ns,
                   std::int64_t round_trip_ns);

  /// Applies records; ignores those that are not above the last index. Throws `WireError` or
  /// `StreamOutOfSync`.
  void records(std::span<const std::byte> message);

  /// True from the end of the first pass of a connection until the next hello.
  [[nodiscard]] bool joined() const noexcept { return joined_; }
  /// True if the controller of the published run has gone.
  [[nodiscard]] bool ended() const noexcept { return ended_; }
  [[nodiscard]] std::uint64_t passes() const noexcept { return passes_; }  ///< published
  /// When the newest published state was read from the server's segment, local clock; 0 if nothing
  /// is published.
  [[nodiscard]] std::int64_t taken_ns() const noexcept { return taken_ns_; }

 private:
  struct LocalSegment;
  struct Waiting {
    std::uint32_t id;
    std::uint64_t version;
    std::size_t at;  // in `Part::bytes`
  };
  struct Part {  // the blocks of one frame that wait for the end of its pass
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

  // The segment of local readers, and the new one that this connection fills; if `next_` is empty,
  // it updates `shown_`.
  std::unique_ptr<LocalSegment> shown_;
  std::unique_ptr<LocalSegment> next_;
  bool joined_ = false;
  bool ended_ = false;
  std::uint64_t passes_ = 0;
  std::int64_t taken_ns_ = 0;
};

}  // namespace kerf::bridge
