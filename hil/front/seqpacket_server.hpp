// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace kerf {

/// One end of a SEQPACKET Unix socket: whole packets, in order, none merged. Owns the descriptor.
class SeqpacketLink {
 public:
  enum class Sent : std::uint8_t { yes, full, closed };

  explicit SeqpacketLink(int fd) noexcept : fd_(fd) {}
  SeqpacketLink(SeqpacketLink&& other) noexcept;
  SeqpacketLink& operator=(SeqpacketLink&&) = delete;
  ~SeqpacketLink();

  /// Oldest waiting packet into `buffer`; a longer one is cut. Empty when none waits, and then
  /// `closed` tells whether the other end is gone. Never blocks.
  [[nodiscard]] std::span<const std::uint8_t> take(std::span<std::uint8_t> buffer) noexcept;
  /// As `take`, but waits up to `timeout_ms` for a packet.
  [[nodiscard]] std::span<const std::uint8_t> wait(std::span<std::uint8_t> buffer,
                                                   int timeout_ms) noexcept;
  /// Never blocks: `full` when the other end does not read.
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept;
  [[nodiscard]] bool closed() const noexcept { return closed_; }

 private:
  int fd_;
  bool closed_ = false;
};

/// A listening socket at a path of the file system.
///
/// The path appears in one step, ready to accept. A socket file that nobody listens on any more is
/// replaced; a live one, or a file of another kind, throws `HilError`. The path is removed at the
/// end.
class SeqpacketServer {
 public:
  explicit SeqpacketServer(std::string path);
  SeqpacketServer(const SeqpacketServer&) = delete;
  SeqpacketServer& operator=(const SeqpacketServer&) = delete;
  ~SeqpacketServer();

  /// Waits for a client; nothing when `stop` became true.
  [[nodiscard]] std::optional<SeqpacketLink> accept(const std::atomic<bool>& stop);

 private:
  std::string path_;
  int fd_ = -1;
};

}  // namespace kerf
