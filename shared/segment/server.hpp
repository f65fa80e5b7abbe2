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

/// Hands the segment of one controller to readers, and their commands to its servo.
///
/// Owns a thread of normal priority that serves a SOCK_SEQPACKET socket: peers of this user (or
/// root) get HELLO and the memfd, read-only; their commands are checked and queued. At most
/// `kMaxPeers` at a time. The writer outlives the server.
class SegmentServer {
 public:
  static constexpr std::size_t kMaxPeers = 32;

  /// Throws `SegmentError` if another live controller has the name; replaces the socket of a dead
  /// one.
  SegmentServer(std::string_view name, const SegmentWriter& writer, CommandLimits limits = {});

  /// For the segment `memfd` of another writer: `answer` handles each command, whose content is
  /// unchecked. The server's thread calls it; while it waits, at most 2 s, no other reader is
  /// served. It must not throw.
  using Answer = std::function<Reply(const Command&)>;
  SegmentServer(std::string_view name, int memfd, std::uint64_t session_id, Answer answer);
  ~SegmentServer();
  SegmentServer(const SegmentServer&) = delete;
  SegmentServer& operator=(const SegmentServer&) = delete;

  /// Servo thread. Wait-free, no system call; take at most one per tick.
  [[nodiscard]] std::optional<Command> take_command() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf
