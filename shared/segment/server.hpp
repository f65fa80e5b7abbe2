// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "shared/segment/command.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// Gives readers the segment of one controller, and queues their commands for its servo.
///
/// Owns a thread of normal priority that serves a SOCK_SEQPACKET socket. A peer of this user or
/// root gets a `SegmentHello` and the memfd, read-only; its commands are checked and queued. Other
/// users, and peers above `kMaxPeers`, are disconnected. The writer outlives the server.
class SegmentServer {
 public:
  static constexpr std::size_t kMaxPeers = 32;

  /// Throws `SegmentError` if another live controller has the name, or if the socket cannot be
  /// made. Replaces the socket of a dead controller.
  SegmentServer(std::string_view name, const SegmentWriter& writer, CommandLimits limits = {});

  /// For the segment `memfd` of another writer. The server's thread calls `answer` with each
  /// command, unchecked. No other reader is served until it returns, so it must return within 2 s,
  /// the time that a reader waits for a reply. It must not throw.
  using Answer = std::function<Reply(const SegmentCommand&)>;
  SegmentServer(std::string_view name, int memfd, std::uint64_t session_id, Answer answer);
  ~SegmentServer();
  SegmentServer(const SegmentServer&) = delete;
  SegmentServer& operator=(const SegmentServer&) = delete;

  /// Servo thread. Wait-free, no system call. The servo takes at most one per tick.
  [[nodiscard]] std::optional<SegmentCommand> take_command() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf
