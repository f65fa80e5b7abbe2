// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hil/devmodel/emulator.hpp"
#include "hil/front/seqpacket_server.hpp"

namespace kerf {

/// The socket at which a window leads the hand: packets of hand_wish.hpp.
///
/// Once the hand is at its start, one window at a time is let in; another one is told so and sent
/// away, and one of another user is refused.
/// What is no wish is dropped and counted. Never waits. One thread.
class HandServer {
 public:
  /// Throws `HilError`; see SeqpacketServer.
  explicit HandServer(const std::string& path) : server_(path, "--hand-socket") {}

  /// Hands the newest wish to the emulator's hand, and forsakes it when the window has gone. Call
  /// between two looks at the host; `cycles` bus cycles have passed since the last call.
  void lead(Emulator& emulator, int cycles) noexcept;

  [[nodiscard]] std::uint64_t wishes() const noexcept { return wishes_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  void look_for_windows() noexcept;

  SeqpacketServer server_;
  std::optional<SeqpacketLink> window_;
  std::int64_t since_look_ = 0;  ///< bus cycles
  std::uint64_t wishes_ = 0, refused_ = 0;
};

}  // namespace kerf
