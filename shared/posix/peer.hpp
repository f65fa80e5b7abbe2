// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <sys/socket.h>
#include <unistd.h>

namespace kerf {

/// Who may use a Unix socket of ours: this user and root. Gives the user at the other end of `fd`
/// where that is another one (or unknown: nobody, -1).
[[nodiscard]] inline std::optional<uid_t> stranger_at(int fd) noexcept {
  ucred peer{};
  socklen_t length = sizeof peer;
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &length) != 0) return static_cast<uid_t>(-1);
  if (peer.uid == geteuid() || peer.uid == 0) return std::nullopt;
  return peer.uid;
}

}  // namespace kerf
