// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hil/front/serving.hpp"

namespace kerf {

/// One end of a SEQPACKET Unix socket: whole packets, in order, none merged. Owns the descriptor.
class SeqpacketLink final : public PacketLink {
 public:
  explicit SeqpacketLink(int fd) noexcept : PacketLink(fd) {}
  SeqpacketLink(SeqpacketLink&& other) noexcept;
  SeqpacketLink& operator=(SeqpacketLink&&) = delete;
  ~SeqpacketLink() override;

  [[nodiscard]] std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept override;
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept override;
};

/// A listening socket at a path of the file system.
///
/// The path appears in one step, ready to accept. A socket file that nobody listens on any more is
/// replaced; a live one, or a file of another kind, throws `HilError` that names `option`. The path
/// is removed at the end.
class SeqpacketServer {
 public:
  explicit SeqpacketServer(std::string path, const char* option = "--socket");
  SeqpacketServer(const SeqpacketServer&) = delete;
  SeqpacketServer& operator=(const SeqpacketServer&) = delete;
  ~SeqpacketServer();

  /// Waits for a client of this user or of root; nothing when `stop` became true, or for so long.
  /// Another user is refused, with a line on stderr.
  [[nodiscard]] std::optional<SeqpacketLink> accept(const std::atomic<bool>& stop,
                                                    std::int64_t patience_ns = kForeverNs);
  /// One that waits already; else nothing, and errno tells where it could not be let in.
  [[nodiscard]] std::optional<SeqpacketLink> accept_waiting() noexcept;

 private:
  std::string path_;
  const char* option_;
  int fd_ = -1;
};

}  // namespace kerf
