// SPDX-License-Identifier: Apache-2.0
#include "web/tab_viewer.hpp"

#include <variant>

#include "bridge/wire/parse.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/command.hpp"

namespace kerf::web {

void TabViewer::slot(bool ended) {
  const std::int64_t now_ns = monotonic_ns();
  if (ended) writer_.set_lifecycle(Lifecycle::clean_end);
  snapshot_.update(now_ns, false);
  stream_->note_changes();
  stream_->slot(now_ns, ended);
}

bool TabViewer::next(std::vector<std::byte>& message) {
  if (replies_.empty()) return stream_->next(monotonic_ns(), message);
  const auto* bytes = reinterpret_cast<const std::byte*>(&replies_.front());
  message.assign(bytes, bytes + sizeof(bridge::ReplyMessage));
  replies_.pop_front();
  return true;
}

bool TabViewer::take(std::span<const std::byte> message) {
  const auto parsed = bridge::parse_up(message);
  if (!parsed) return false;
  if (const auto* ack = std::get_if<bridge::AckMessage>(&*parsed)) {
    return stream_->acked(*ack, monotonic_ns());
  }
  if (std::holds_alternative<bridge::ViewMessage>(*parsed)) return true;  // nobody follows in a tab
  const auto& command = std::get<bridge::CommandMessage>(*parsed);
  // Of a page that has not yet heard that this is a run without commands.
  constexpr auto kRefused = static_cast<std::uint32_t>(ReplyStatus::refused);
  replies_.push_back(
      answer_ ? answer_(command)
              : bridge::ReplyMessage{bridge::kReplyMagic, command.sequence, kRefused, 0});
  return true;
}

}  // namespace kerf::web
