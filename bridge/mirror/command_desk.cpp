// SPDX-License-Identifier: Apache-2.0
#include "bridge/mirror/command_desk.hpp"

#include <utility>

namespace kerf::bridge {

Reply CommandDesk::ask(const Command& command) noexcept {
  std::unique_lock lock(mutex_);
  if (link_ != Link::open) {
    return {link_ == Link::down ? ReplyStatus::busy : ReplyStatus::refused, 0};
  }
  to_send_ = CommandMessage{kCommandMagic, static_cast<std::uint32_t>(command.kind),
                            command.argument, ++sequence_};
  reply_.reset();
  answered_.wait_for(lock, kPatience, [this] { return reply_.has_value(); });
  to_send_.reset();
  return reply_.value_or(Reply{ReplyStatus::busy, 0});
}

std::optional<CommandMessage> CommandDesk::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(to_send_, std::nullopt);
}

void CommandDesk::answer(const ReplyMessage& reply) {
  const std::lock_guard lock(mutex_);
  if (reply.sequence != sequence_) return;  // to one that was given up
  const bool known = reply.status <= static_cast<std::uint32_t>(ReplyStatus::refused);
  reply_ =
      Reply{known ? static_cast<ReplyStatus>(reply.status) : ReplyStatus::refused, reply.index};
  answered_.notify_one();
}

void CommandDesk::set_link(Link link) {
  const std::lock_guard lock(mutex_);
  link_ = link;
  if (link == Link::open) return;
  reply_ = Reply{};  // nobody answers any more
  reply_->status = ReplyStatus::busy;
  answered_.notify_one();
}

}  // namespace kerf::bridge
