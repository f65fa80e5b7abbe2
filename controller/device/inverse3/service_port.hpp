// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <semaphore.h>

#include "controller/device/inverse3/turn_game.hpp"
#include "controller/device/inverse3/web_socket.hpp"
#include "controller/device/port/io_mailbox.hpp"
#include "shared/wire/emulator_link.hpp"

namespace kerf::inverse3 {

/// What follows "ws" in `--port
/// ws[:[HOST:]PORT][,park=NAME][,device=ID][,handle=ID][,events=PORT]`.
struct ServiceOptions {
  HostPort service{"127.0.0.1", kServicePort};
  /// Port of the service's events; 0: none. Of another service port than the usual one there is
  /// none unless it is named.
  std::uint16_t event_port = kEventPort;
  Wanted wanted;
};
/// Throws std::runtime_error with one line.
[[nodiscard]] ServiceOptions parse_service_port(std::string_view text);

/// The Inverse3 by its vendor's Inverse Service, as a port of `CartesianReport` and
/// `CartesianCommand`.
///
/// One I/O thread plays the turns: a force, then the service's one reply; the next when that is in
/// and the servo has a newer command, or a millisecond has passed. Never two messages at once. The
/// servo touches only the mailboxes, and in `send` a semaphore, which any thread and any signal
/// handler may raise.
///
/// A reply that takes longer than 5 ms is counted; than 20 ms, and the next turn takes the force
/// back; than 100 ms, and the connection is dropped. So it is after three messages in a row that
/// cannot be read, and when the service has sent a closing frame or ended its side of the link.
/// Whatever ends a connection, zero force is the last message on it (`TurnGame`).
///
/// A new connection is tried at once, then after 0.5, 1, 2 ... 10 s; version, force_scale and an
/// idle device are checked again, and it is barred like the first one until the parking button is
/// held: but the servo gives a silent device up after 2 s. What cannot become right (`is_final`)
/// closes the port, with one line on stderr.
///
/// In lock-step, with kerf's emulated service, a turn is one period of the servo, whatever the
/// machine's clock says.
class ServicePort final : public MailboxPort {
 public:
  static constexpr std::int64_t kFirstBackoffNs = 500'000'000;
  static constexpr std::int64_t kLongestBackoffNs = 10'000'000'000;

  /// Connects, proves the force command while the device is well, then starts the thread. Tries for
  /// `patience_ms` while no service answers or it has no device, or until `stop`. Throws
  /// std::runtime_error with one line.
  ServicePort(const ServiceOptions& options, const LinkHello& ours, int patience_ms,
              const std::atomic<bool>& stop, IoThread io = {});
  /// Turns without force for 20 ms, then closes; an attempt to connect ends within 40 ms, but for
  /// the look-up of a host's name.
  ~ServicePort() override;
  ServicePort(const ServicePort&) = delete;
  ServicePort& operator=(const ServicePort&) = delete;

  bool send(std::span<const std::uint8_t> packet) noexcept override;
  [[nodiscard]] std::vector<LinkCounter> counters() const override;

 private:
  /// A service that answers, its events, and what was agreed.
  struct Connection {
    std::unique_ptr<WebSocket> service, events;
    TurnGame turns;
    std::int64_t began_ns = 0;
  };
  enum class Turn : std::uint8_t { done, lost };

  /// Ends soon after `stop`, by an exception.
  [[nodiscard]] std::unique_ptr<Connection> connect(const std::atomic<bool>& stop);
  void connect_within(int patience_ms, const std::atomic<bool>& stop);
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
  void end() noexcept;
  void note_bar() noexcept;
  void note(const std::string& text) const noexcept;
  void note_once(bool& is_noted, const std::string& text) const noexcept;
  /// Time of the wait for a reply; stands still in lock-step.
  [[nodiscard]] std::int64_t wait_ns() const noexcept;
  /// Time of the turns.
  [[nodiscard]] std::int64_t now_ns() const noexcept;
  [[nodiscard]] std::string place() const;

  ServiceOptions options_;
  LinkHello ours_;
  IoThread io_;
  std::unique_ptr<Connection> connection_;
  std::uint32_t number_ = 0;  ///< of the newest report
  std::uint64_t turns_ = 0;   ///< of all connections
  std::int64_t sent_ns_ = 0;  ///< the last message, by the machine's clock
  std::int64_t backoff_ns_ = 0, retry_ns_ = 0;
  Bar noted_ = Bar::parking;
  bool has_noted_scale_ = false, has_noted_events_ = false;
  std::string noted_failure_;  ///< of the newest attempt to connect again
  std::string why_lost_;       ///< the connection, or its unreadable replies
  CartesianCommand command_;
  std::int64_t command_ns_ = 0;          ///< when it came, in time of the turns
  std::atomic<std::int64_t> put_ns_{0};  ///< when the newest command was given, by the clock

  sem_t raised_{};  ///< once per command, and once to stop
  /// In the order of `counters`.
  std::atomic<std::uint64_t> packets_{0}, overflow_{0}, commands_{0}, late_{0}, lost_{0},
      unreadable_{0}, strays_{0}, bars_{0}, reconnections_{0}, longest_us_{0};
  std::thread thread_;
};

}  // namespace kerf::inverse3
