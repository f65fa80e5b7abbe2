// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "arm/inverse3/messages.hpp"
#include "shared/wire/cartesian.hpp"

// One connection to the Inverse Service, without its socket: which device, whether its force
// command is understood, when it may push, and kerf's own reports out of its states.

namespace kerf::inverse3 {

/// Why the device may not push now, or for good.
enum class Bar : std::uint8_t {
  none,
  parking,  ///< the parking button was not held since the connection or the last other bar
  // These end by themselves, or by the user:
  gone,
  unpowered,
  uncalibrated,
  not_ready,
  driven,    ///< after a lost connection: not idle, perhaps by kerf's own last force
  proving,   ///< zero forces, until the service shows that it takes them
  replaced,  ///< gone, and another one is listed
  no_handle,
  several_handles,
  handle_asleep,
  no_button,  ///< the handle has no button of the parking button's name
  echo,       ///< the service gives another force than was sent
  idle,       ///< it has stopped to give any
  event,      ///< of the event port
  stalled,    ///< no reply for so long that the force was taken back
  // These end the connection for good:
  unproven,
  moved_frame,  ///< basis or mount of the session
  damped,
};
[[nodiscard]] constexpr bool is_final(Bar bar) noexcept {
  return bar >= Bar::unproven;
}
/// The service's list has not the device.
[[nodiscard]] constexpr bool is_absent(Bar bar) noexcept {
  return bar == Bar::gone || bar == Bar::replaced;
}
/// What it is and the way out, to follow a place.
[[nodiscard]] std::string text_of(Bar bar);

/// Which device of the service, and what its handle's buttons are.
struct Wanted {
  ShortText device_id{};  ///< empty: the only one
  ShortText park{};  ///< name of the parking button; empty: `c`, or the only one of a wired handle
  ShortText handle_id{};  ///< empty: the only one
  /// The device is that of an earlier connection, not of the user's word.
  bool is_again = false;
};

/// Turns of one connection: the force to send, then the reply. Times in ns of any clock that goes
/// forward: of the machine, or in lock-step of the turns. Neither blocks, throws nor allocates,
/// except where stated. One thread.
///
/// Forces go out only between the parking button, held and let go by the rules of the servo, and
/// the next bar. A bar shows in the reports as `homed = false` for at least kBarNs, so no tick
/// misses it, and lasts until the parking button is held afterwards.
///
/// **Proof.** A service ignores a misspelt force command without an error, so no device is armed on
/// the protocol's word: before its first force its state must be idle, and after kProofTurns zero
/// forces no longer. A device that another program drives proves nothing, and is refused. After a
/// lost connection the force that it still gives may be kerf's own: the first message takes it
/// back, and the next ones have no force, until the device is idle.
///
/// **Echo.** Since 3.5 a state has the force that the device gives. On each axis it must lie within
/// what was sent in the last kEchoWindowNs, give or take kEchoToleranceN; if it does not for longer
/// than kEchoPatienceNs, something else moves the arm. Before 3.5 a state that falls idle is all
/// that can be seen.
class Session {
 public:
  static constexpr int kProofTurns = 10;
  static constexpr std::int64_t kBarNs = 50'000'000;
  static constexpr std::int64_t kEchoWindowNs = 20'000'000;
  static constexpr std::int64_t kEchoPatienceNs = 20'000'000;
  static constexpr double kEchoToleranceN = 0.05;  // the device's step is 0.014 N
  /// A command that is older is of a servo that stands still: no force.
  static constexpr std::int64_t kCommandNs = 20'000'000;

  /// `first` is the first message. Throws std::runtime_error with the reason and the way out if it
  /// has not the wanted device, several devices or handles and none is wanted, or for the first
  /// time
  /// (`Wanted::is_again`) a device that is not idle. If its configuration cannot be borne, `bar` is
  /// final from the start.
  Session(const Wanted& wanted, ForceKey key, const ServiceState& first, std::int64_t now_ns);

  /// The force to send in this turn, N in the service's frame: that of the newest command, which
  /// came at `came_ns`, if the device may push; else none.
  [[nodiscard]] std::array<double, 3> force_n(const CartesianCommand& command, std::int64_t came_ns,
                                              std::int64_t now_ns) noexcept;
  /// A reply. The report is for the servo; empty for a state that has no position of the device, or
  /// one that cannot be: then nothing is learnt from it, and `why_unread` has the reason. `number`
  /// is that of the report.
  [[nodiscard]] std::optional<CartesianReport> take(const ServiceState& state, std::uint32_t number,
                                                    std::int64_t now_ns) noexcept;
  /// Why the newest state had no report, and a way out. Allocates.
  [[nodiscard]] std::string why_unread() const;
  /// The last report of a connection that is lost: its last pose, from a device that may not push.
  [[nodiscard]] CartesianReport farewell(std::uint32_t number) const noexcept;
  /// Takes the force back for another reason. A final bar stays.
  void raise(Bar bar, std::int64_t now_ns) noexcept;

  /// The most important present reason.
  [[nodiscard]] Bar bar() const noexcept { return bar_; }
  [[nodiscard]] bool is_proven() const noexcept { return proof_turns_ > kProofTurns; }
  /// Messages are without a force now, to see whether the device falls idle.
  [[nodiscard]] bool is_probing() const noexcept { return !was_idle_ && sent_count_ > 0; }
  [[nodiscard]] const ShortText& device_id() const noexcept { return device_id_; }
  [[nodiscard]] ForceKey key() const noexcept { return key_; }
  /// Gain of the service's force gate, if it has said so.
  [[nodiscard]] std::optional<double> force_gate() const noexcept { return force_gate_; }

 private:
  struct Sent {
    std::int64_t at_ns = 0;
    std::array<double, 3> force_n{};
  };

  [[nodiscard]] Bar bar_of_arm(const ArmState& arm, std::int64_t now_ns) noexcept;
  [[nodiscard]] Bar bar_of_config(const ArmState& arm) noexcept;
  [[nodiscard]] Bar bar_of_echo(const ArmState& arm, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool is_echo_near(const ArmState& arm, std::int64_t now_ns) const noexcept;
  [[nodiscard]] Bar take_handle(const ServiceState& state, CartesianReport& report) noexcept;
  [[nodiscard]] const HandleState* handle_of(const ServiceState& state, Bar& why) const noexcept;
  void settle(Bar present, bool parked, std::int64_t now_ns) noexcept;

  ShortText device_id_, park_, wanted_handle_;
  ForceKey key_;
  Bar bar_ = Bar::parking;
  std::int64_t barred_until_ns_ = 0;
  bool was_idle_ = true;  ///< of this connection
  int proof_turns_ = 0;
  std::optional<std::int64_t> echo_off_since_ns_;
  std::array<Sent, 256> sent_{};  ///< ring; 20 ms at 8 kHz are 160
  std::size_t sent_count_ = 0;
  std::optional<double> force_gate_;
  ShortText handle_id_;
  std::array<std::optional<double>, 3> unread_m_;  ///< the position that could not be
  CartesianReport last_;                           ///< its pose lasts while the device is gone
};

/// A position or a vector of the service's frame in kerf's, and back: x = X, y = Z, z = -Y.
[[nodiscard]] constexpr std::array<double, 3> kerf_from_service(
    const std::array<double, 3>& v) noexcept {
  return {v[0], v[2], -v[1]};
}
[[nodiscard]] constexpr std::array<double, 3> service_from_kerf(
    const std::array<double, 3>& v) noexcept {
  return {v[0], -v[2], v[1]};
}

}  // namespace kerf::inverse3
