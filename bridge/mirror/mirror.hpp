// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "bridge/mirror/clock_offset.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/mirror_writer.hpp"

namespace kerf::bridge {

/// What arrived does not fit what is held: the way out is a new connection, which starts afresh
/// while readers keep the picture that they have. One line.
struct OutOfStep : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The far end of a bridge without its network: messages in, a local segment out.
///
/// A run's first pass goes straight into a segment that nobody has yet; with its last frame the
/// segment gets the name, and the one of an earlier run goes. Later passes wait in private memory
/// and are published at once when they are whole, so readers see the state of one tick or the one
/// before it, however slow the link is. Beyond the segment it holds 16 bytes a block and the pass
/// under way.
///
/// One thread, but for `Answer`, which the segment server's thread calls.
class Mirror {
 public:
  /// Throws `SegmentError` where `name` cannot be used or another controller has it. A segment of
  /// more than `most_bytes` is refused.
  Mirror(std::string name, std::uint64_t most_bytes, SegmentServer::Answer answer);
  Mirror(const Mirror&) = delete;
  Mirror& operator=(const Mirror&) = delete;
  ~Mirror();

  /// First message of a connection, or a new run's. All that is held of a stream is void. Throws
  /// `WireError` where it does not hold, `SegmentError` where it is of another layout, too large or
  /// there is no memory.
  const HelloMessage& hello(std::span<const std::byte> message, std::int64_t now_ns,
                            std::int64_t round_trip_ns);

  /// Applies a frame; what it returns is to be sent back. Throws `WireError` or `OutOfStep`, and
  /// `SegmentError` where the name was taken in the meantime.
  AckMessage frame(std::span<const std::byte> message, std::int64_t now_ns,
                   std::int64_t round_trip_ns);

  /// Applies records; what is not above the last index is known already. Throws `WireError`.
  void records(std::span<const std::byte> message);

  /// True from the first whole pass of a connection until the next greeting.
  [[nodiscard]] bool joined() const noexcept { return joined_; }
  /// True where the controller of the run that is shown has gone.
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
  struct Part {  // what of one frame waits for the end of its pass
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
