// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>

#include "bridge/wire/messages.hpp"
#include "shared/segment/command.hpp"

namespace kerf::bridge {

/// Where a command of a local reader waits for the other machine's answer. One at a time: the
/// segment server's thread asks, the network's thread looks for it as often as something arrives,
/// at least 60 times a second, sends it and brings the answer.
class CommandDesk {
 public:
  /// What the link can do: no connection is a reason to try again, no right is not.
  enum class Link : std::uint8_t { down, read_only, open };
  /// An answer later than that is no answer; a local reader waits for 2 s.
  static constexpr std::chrono::milliseconds kPatience{1500};

  /// Waits for the answer, at most `kPatience`: then `busy`, though the command may still come.
  [[nodiscard]] Reply ask(const Command& command) noexcept;

  /// Network: what is to be sent, once.
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

}  // namespace kerf::bridge
