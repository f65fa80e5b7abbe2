// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "arm/exchange.hpp"
#include "arm/inverse3/turn_game.hpp"
#include "arm/inverse3/web_socket.hpp"
#include "arm/vendor_arm.hpp"

namespace kerf {

/// [HOST:]PORT of a service; empty: that of this machine. Throws ArmError.
[[nodiscard]] inverse3::HostPort parse_service(std::string_view text);

/// An Inverse3, through its vendor's Inverse Service.
///
/// A separate thread plays the turns: a force, then the service's one reply; the next when that is
/// in and the controller has a newer command, or a millisecond has passed. Never two messages at
/// once.
///
/// A reply that takes longer than 5 ms is counted; than 20 ms, and the next turn takes the force
/// back; than 100 ms, and the connection is dropped. So it is after three messages in a row that
/// cannot be read, and when the service has sent a closing frame or ended its side of the link.
/// Whatever ends a connection, zero force is the last message on it (`TurnGame`).
///
/// A new connection is tried at once, then after 0.5, 1, 2 ... 10 s; version, force_scale and an
/// idle device are checked again, and it is barred like the first one until the parking button is
/// held: but the servo gives a silent device up after 2 s. What cannot become right (`is_final`)
/// fails the exchange.
///
/// With kerf's emulated service in lock-step, which says so itself, a turn is one period of the
/// servo, whatever the machine's clock says.
class ServiceArm final : public VendorArm {
 public:
  struct Options {
    inverse3::HostPort service{"127.0.0.1", inverse3::kServicePort};
    std::uint16_t event_port = inverse3::kEventPort;  ///< of the service's events; 0: none
    inverse3::Wanted wanted;
    int patience_ms = 10'000;  ///< while no service answers, or it has no device
    int priority = 81;         ///< SCHED_FIFO; 0: none
    int core = -1;             ///< of the thread; -1: the last one
  };
  static constexpr int kConnectMs = 1000;  ///< for each step of an attempt to connect

  /// `stop` ends an attempt to connect within 40 ms, but for the look-up of a host's name.
  ServiceArm(const Options& options, ArmExchange& exchange, const std::atomic<bool>& stop);

  /// Connects, and proves the force command while the device is well. Returns without a device if
  /// `stop` was set meanwhile.
  void open() override;
  void start() override;
  void stop() override;
  void close() override;
  [[nodiscard]] std::string text_of(std::uint32_t failure) const override;
  /// `errors` are these counters.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> errors() const override;

 private:
  /// A service that answers, its events, and what was agreed.
  struct Connection {
    std::unique_ptr<inverse3::WebSocket> service, events;
    inverse3::TurnGame turns;
    std::int64_t began_ns = 0;
  };
  enum class Turn : std::uint8_t { done, lost };

  /// Ends soon after `stop`, by an exception.
  [[nodiscard]] std::unique_ptr<Connection> connect(const std::atomic<bool>& stop);
  void use(std::unique_ptr<Connection> connection) noexcept;
  void prove();
  void check_force_scale(const std::atomic<bool>& stop);

  void run() noexcept;
  [[nodiscard]] bool wait_for_turn() noexcept;
  [[nodiscard]] Turn play_turn() noexcept;
  [[nodiscard]] Turn await_reply() noexcept;
  [[nodiscard]] Turn take_reply(std::string_view text) noexcept;
  [[nodiscard]] Turn lose(const std::string& why) noexcept;
  void pass_on(const CartesianReport& report) noexcept;
  void take_events() noexcept;
  void drop() noexcept;
  void reconnect() noexcept;
  void fail(const std::string& why) noexcept;
  void note_bar() noexcept;
  void note(const std::string& text) const noexcept;
  void note_once(bool& is_noted, const std::string& text) const noexcept;
  [[nodiscard]] bool in_lockstep() const noexcept { return lockstep_hz_ > 0; }
  /// Time of the wait for a reply; stands still in lock-step.
  [[nodiscard]] std::int64_t wait_ns() const noexcept;
  /// Time of the turns.
  [[nodiscard]] std::int64_t now_ns() const noexcept;
  [[nodiscard]] std::string location() const;

  Options options_;
  ArmExchange& exchange_;
  const std::atomic<bool>& stop_opening_;
  int lockstep_hz_ = 0;
  std::unique_ptr<Connection> connection_;
  std::uint64_t turns_ = 0;   ///< of all connections
  std::uint64_t ticket_ = 0;  ///< of the newest command
  std::int64_t sent_ns_ = 0;  ///< the last message, by the machine's clock
  std::int64_t backoff_ns_ = 0, retry_ns_ = 0;
  inverse3::Bar noted_ = inverse3::Bar::parking;
  bool has_noted_scale_ = false, has_noted_events_ = false;
  std::string noted_failure_;  ///< of the newest attempt to connect again
  std::string why_lost_;       ///< the connection, or its unreadable replies
  std::string failure_;        ///< set before the exchange fails

  /// In the order of `errors`.
  std::atomic<std::uint64_t> packets_{0}, commands_{0}, late_{0}, lost_{0}, unreadable_{0},
      strays_{0}, bars_{0}, reconnections_{0}, longest_us_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kerf
