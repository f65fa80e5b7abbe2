// SPDX-License-Identifier: Apache-2.0
#include "arm/inverse3/turn_game.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <utility>

namespace kerf::inverse3 {

std::string_view TurnGame::next(const CartesianCommand& command, std::int64_t came_ns,
                                std::int64_t clock_ns, std::int64_t now_ns,
                                MessageBuffer& buffer) noexcept {
  const bool takes_back = std::exchange(takes_back_, false);
  const bool is_probe = session_.is_probing();
  const auto force_n = session_.force_n(takes_back ? CartesianCommand{} : command, came_ns, now_ns);
  const bool names_itself = turns_ == 0 && session_.key() == ForceKey::vector;
  const Extra extra = names_itself                    ? Extra::profile
                      : turns_ % kFullStateTurns == 1 ? Extra::full_state
                                                      : Extra::none;
  ++turns_;
  sent_ns_ = clock_ns;
  limits_passed_ = 0;
  if (is_probe) return probe_message(session_.device_id(), buffer);
  return force_message(session_.device_id(), session_.key(), force_n, extra, buffer);
}

namespace {

constexpr std::array kLimitsNs{TurnGame::kLateNs, TurnGame::kTakeBackNs, TurnGame::kDropNs};

}  // namespace

void TurnGame::stall(std::int64_t now_ns) noexcept {
  takes_back_ = true;
  session_.raise(Bar::stalled, now_ns);
}

std::int64_t TurnGame::look_ns() const noexcept {
  const std::int64_t next = sent_ns_ + kLimitsNs[static_cast<std::size_t>(limits_passed_)];
  return unread_ > 0 ? std::min(next, unread_ns_ + kUnreadNs) : next;
}

TurnGame::Wait TurnGame::look(std::int64_t clock_ns, std::int64_t now_ns) noexcept {
  if (is_overdue(clock_ns)) return Wait::lost;
  if (clock_ns - sent_ns_ < kLimitsNs[static_cast<std::size_t>(limits_passed_)]) {
    return Wait::goes_on;
  }
  if (limits_passed_ == 2) return Wait::lost;
  if (limits_passed_++ == 0) return Wait::late;
  stall(now_ns);
  return Wait::stalled;
}

TurnGame::Reply TurnGame::take(std::string_view text, std::uint32_t number, std::int64_t clock_ns,
                               std::int64_t now_ns,
                               std::optional<CartesianReport>& report) noexcept {
  // The caller itself may have been held up; then the reply was there on waking up.
  if (clock_ns - sent_ns_ >= kTakeBackNs && limits_passed_ < 2) stall(now_ns);
  try {
    has_state_ = parse_state(text, state_);
  } catch (const std::bad_alloc&) {
    has_state_ = false;
  }
  report = has_state_ ? session_.take(state_, number, now_ns) : std::nullopt;
  if (report || (has_state_ && is_absent(session_.bar()))) {
    unread_ = 0;
    return Reply::read;
  }
  if (unread_++ == 0) unread_ns_ = clock_ns;
  return unread_ >= kMostUnread || is_overdue(clock_ns) ? Reply::lost : Reply::unread;
}

std::string TurnGame::why_lost() const {
  if (unread_ == 0) {
    return "the service has not replied for 100 ms; see what else this machine does, and systemctl "
           "status haply-inverse-service";
  }
  return std::to_string(unread_) + " replies of the service in a row cannot be read: " +
         (has_state_ ? session_.why_unread()
                     : "they are no JSON of a state; see which service it is by systemctl status "
                       "haply-inverse-service");
}

}  // namespace kerf::inverse3
