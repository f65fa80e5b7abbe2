// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "arm/inverse3/session.hpp"

namespace kerf::inverse3 {

/// The game of turns on one connection, without its socket: which message goes out, what a reply or
/// its absence means, and when the connection is over. `ServiceArm` plays it over a WebSocket,
/// kerf-lab in virtual time.
///
/// Whatever ends a connection, `last_word` is the last message on it: what a service does with the
/// force of a client that is gone is not known. From the first bad sign to that message at most
/// 20 ms pass, as from the last report to zero force on any other link (docs/safety.md): a closed
/// connection shows at the next look, a millisecond later at most; a third unreadable reply after
/// two more turns; and if those turns are slow, kUnreadNs after the first one.
///
/// Two clocks: `clock_ns` of the wait for a reply, and `now_ns` of the session, which in lock-step
/// is that of the turns; the first one then stands still. Neither blocks nor throws; allocates
/// only in the constructor and `why_lost`. One thread.
class TurnGame {
 public:
  static constexpr std::int64_t kTurnNs = 1'000'000;  ///< longest pause between two turns
  static constexpr std::int64_t kLateNs = 5'000'000, kTakeBackNs = 20'000'000;
  static constexpr std::int64_t kDropNs = 100'000'000;
  static constexpr int kMostUnread = 3;
  /// 20 ms less the 5 ms by which a wake-up may be late before it counts.
  static constexpr std::int64_t kUnreadNs = kTakeBackNs - kLateNs;
  static constexpr std::uint64_t kFullStateTurns = 2000;  ///< between two requests for all state
  /// After a lost connection the next one is tried at once, unless the lost one was shorter than
  /// the first of these pauses; each is twice as long as the one before.
  static constexpr std::int64_t kFirstBackoffNs = 500'000'000;
  static constexpr std::int64_t kLongestBackoffNs = 10'000'000'000;

  /// Throws as `Session`.
  TurnGame(const Wanted& wanted, ForceKey key, const ServiceState& first, std::int64_t now_ns)
      : session_(wanted, key, first, now_ns) {}

  [[nodiscard]] Session& session() noexcept { return session_; }

  /// The message of the next turn, which goes out at `clock_ns`; a view of `buffer`.
  [[nodiscard]] std::string_view next(const CartesianCommand& command, std::int64_t came_ns,
                                      std::int64_t clock_ns, std::int64_t now_ns,
                                      MessageBuffer& buffer) noexcept;

  enum class Wait : std::uint8_t { goes_on, late, stalled, lost };
  /// The reply is not there yet. `late` and `stalled` once a turn: it takes longer than kLateNs, or
  /// than kTakeBackNs, so that the device is barred and the next message takes the force back.
  [[nodiscard]] Wait look(std::int64_t clock_ns, std::int64_t now_ns) noexcept;
  /// When to look again.
  [[nodiscard]] std::int64_t look_ns() const noexcept;

  /// What a reply was. `unread` has no report, nor has `read` while the service's list has not the
  /// device; after `lost` the connection is to be ended.
  enum class Reply : std::uint8_t { read, unread, lost };
  /// A reply has come; one that is not text is empty. `number`: of the report.
  [[nodiscard]] Reply take(std::string_view text, std::uint32_t number, std::int64_t clock_ns,
                           std::int64_t now_ns, std::optional<CartesianReport>& report) noexcept;
  /// After `lost`: the reason and a way out.
  [[nodiscard]] std::string why_lost() const;

 private:
  [[nodiscard]] bool is_overdue(std::int64_t clock_ns) const noexcept {
    return unread_ > 0 && clock_ns - unread_ns_ >= kUnreadNs;
  }
  void stall(std::int64_t now_ns) noexcept;

  Session session_;
  ServiceState state_;  ///< of the newest message
  std::uint64_t turns_ = 0;
  bool takes_back_ = false;
  std::int64_t sent_ns_ = 0;
  int limits_passed_ = 0;       ///< of the reply that is out
  int unread_ = 0;              ///< replies in a row that could not be read
  std::int64_t unread_ns_ = 0;  ///< when the first of them came
  bool has_state_ = true;       ///< the newest reply was JSON of a state
};

/// Zero force: the last message of a connection.
[[nodiscard]] inline std::string_view last_word(const ShortText& device_id, ForceKey key,
                                                MessageBuffer& buffer) noexcept {
  return force_message(device_id, key, {}, Extra::none, buffer);
}

}  // namespace kerf::inverse3
