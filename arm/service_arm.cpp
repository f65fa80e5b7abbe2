// SPDX-License-Identifier: Apache-2.0
#include "arm/service_arm.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <stdexcept>
#include <system_error>

#include <poll.h>
#include <unistd.h>

#include "arm/arm_error.hpp"
#include "arm/guard.hpp"
#include "arm/inverse3/service_answers.hpp"
#include "arm/overseer.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/posix/threads.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/cartesian.hpp"

namespace kerf {

using inverse3::Bar;
using inverse3::ForceKey;
using inverse3::HostPort;
using inverse3::kNeeds;
using inverse3::MessageBuffer;
using inverse3::Refusal;
using inverse3::ServiceState;
using inverse3::Session;
using inverse3::TurnGame;
using inverse3::WebSocket;

namespace {

constexpr int kMostStrays = 64, kMostEvents = 16;  // in a turn: a flood cannot hold the force
constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kLookNs = 20 * kNsPerMs;  ///< longest delay of the end
constexpr int kCloseMs = 100, kDroppedCloseMs = 20;
constexpr int kLockStepPatienceMs = 2000;
constexpr std::uint32_t kRefused = 1;  ///< the exchange's code; `failure_` has the text

constexpr const char* kClosed =
    "the service has closed the connection; see systemctl status haply-inverse-service, and end "
    "other programs that use it";

}  // namespace

HostPort parse_service(std::string_view text) {
  HostPort out{"127.0.0.1", inverse3::kServicePort};
  if (text.empty()) return out;
  const std::size_t colon = text.rfind(':');
  const bool has_host = colon != std::string_view::npos;
  std::string_view host = has_host ? text.substr(0, colon) : "";
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const std::string_view port = text.substr(has_host ? colon + 1 : 0);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), out.port);
  if (error != std::errc{} || end != port.data() + port.size() || out.port == 0 ||
      (has_host && host.empty())) {
    throw ArmError("--service " + escaped(text) +
                   ": not [HOST:]PORT; leave it out for the service of this machine");
  }
  if (has_host) out.host = host;
  return out;
}

ServiceArm::ServiceArm(const Options& options, ArmExchange& exchange, const std::atomic<bool>& stop)
    : options_(options), exchange_(exchange), stop_opening_(stop) {}

std::string ServiceArm::location() const {
  return "--service " + options_.service.host + ":" + std::to_string(options_.service.port);
}

std::int64_t ServiceArm::wait_ns() const noexcept {
  return in_lockstep() ? 0 : monotonic_ns();
}

std::int64_t ServiceArm::now_ns() const noexcept {
  if (!in_lockstep()) return monotonic_ns();
  return static_cast<std::int64_t>(turns_) * (kNsPerSecond / lockstep_hz_);
}

/// At each connection: another client may have changed it since the last one. Later in a connection
/// the echo shows it.
void ServiceArm::check_force_scale(const std::atomic<bool>& stop) {
  std::optional<double> scale;
  try {
    scale = force_scale_of(
        inverse3::http_get(options_.service, "/settings/devices/force_scale", kConnectMs, stop));
  } catch (const std::runtime_error&) {  // settings are read where there are some
  }
  if (!scale) {
    note_once(
        has_noted_scale_,
        "devices/force_scale of the service cannot be read; see in the vendor's Hub that it is 1");
  } else if (*scale != 1) {
    throw Refusal("the service scales every force by " + number_text(*scale) +
                  "; set devices/force_scale to 1 in the vendor's Hub");
  }
}

std::unique_ptr<ServiceArm::Connection> ServiceArm::connect(const std::atomic<bool>& stop) {
  const inverse3::ServiceVersion version =
      version_in(inverse3::http_get(options_.service, "/version", kConnectMs, stop));
  const ForceKey key = version.key;
  if (!options_.wanted.is_again) {
    facts_ = {{"service", options_.service.host + ":" + std::to_string(options_.service.port)},
              {"version", version.text}};
    lockstep_hz_ = version.lockstep_hz;
    if (in_lockstep()) exchange_.set_lockstep(lockstep_hz_);
  }
  std::unique_ptr<WebSocket> service;
  try {
    service = std::make_unique<WebSocket>(options_.service, kConnectMs, stop);
  } catch (const inverse3::UpgradeRefused& refused) {
    throw_status("the service", refused.answer());
  }
  // Kerf's force may still act since the last connection, so whatever ends this one takes it back.
  MessageBuffer buffer;
  if (options_.wanted.is_again) {
    service->set_last_word(last_word(options_.wanted.device_id, key, buffer));
  }
  if (key == ForceKey::vector) check_force_scale(stop);
  // The service speaks first.
  const std::int64_t until_ns = monotonic_ns() + kConnectMs * kNsPerMs;
  WebSocket::Got got{};
  do {
    got = service->receive(std::min(until_ns, monotonic_ns() + kLookNs));
  } while (got == WebSocket::Got::nothing && !stop && monotonic_ns() < until_ns);
  if (got != WebSocket::Got::text) {
    throw std::runtime_error(std::string("the service sends no list of its devices; ") + kNeeds);
  }
  ServiceState first;
  if (!parse_state(service->message(), first)) {
    throw std::runtime_error(std::string("the list of the devices cannot be read; ") + kNeeds);
  }
  auto made = std::make_unique<Connection>(
      Connection{std::move(service), {}, TurnGame(options_.wanted, key, first, now_ns())});
  Session& session = made->turns.session();
  if (is_final(session.bar())) throw Refusal(inverse3::text_of(session.bar()));
  made->service->set_last_word(last_word(session.device_id(), key, buffer));
  made->began_ns = monotonic_ns();
  if (options_.event_port != 0) {
    try {
      made->events = std::make_unique<WebSocket>(
          HostPort{options_.service.host, options_.event_port}, kConnectMs, stop);
    } catch (const std::exception& error) {
      note_once(has_noted_events_, "no events of the service at port " +
                                       std::to_string(options_.event_port) + " (" + error.what() +
                                       "): its own faults show only in the device's state");
    }
  }
  return made;
}

/// The guard has the last word of this connection and of no other.
void ServiceArm::use(std::unique_ptr<Connection> connection) noexcept {
  leave_last_word(-1, {});
  connection_ = std::move(connection);
  if (!connection_) return;
  leave_last_word(connection_->service->handle(), connection_->service->last_word_bytes());
}

void ServiceArm::open() {
  const std::int64_t give_up_ns = monotonic_ns() + options_.patience_ms * kNsPerMs;
  while (!connection_) {
    try {
      use(connect(stop_opening_));
      break;
    } catch (const Refusal& refusal) {
      throw ArmError(location() + ": " + refusal.what());
    } catch (const std::runtime_error& error) {
      if (stop_opening_) return;
      if (monotonic_ns() >= give_up_ns) {
        const std::string why = error.what();
        const bool has_way_out = why.find(';') != std::string::npos;
        throw ArmError(location() + ": " + why + (has_way_out ? "" : std::string("; ") + kNeeds));
      }
    }
    sleep_until_ns(std::min(monotonic_ns() + 50 * kNsPerMs, give_up_ns));
  }
  // From now on it is this device, whatever else appears.
  const inverse3::ShortText& id = connection_->turns.session().device_id();
  options_.wanted.device_id = id;
  options_.wanted.is_again = true;
  facts_.emplace_back("model", "Inverse3 " + std::string(id.view()));
  prove();
}

/// Plays the turns of the proof, so that a service of another key is refused at the start. A device
/// that is not well proves it later.
void ServiceArm::prove() {
  for (int turn = 0; turn < Session::kProofTurns; ++turn) {
    // The service's state may be older than a turn on a fast link: 50 ms in all.
    constexpr std::int64_t kPauseNs = 5 * kNsPerMs;
    if (!in_lockstep() && turn > 0) sleep_until_ns(sent_ns_ + kPauseNs);
    if (play_turn() == Turn::lost) {
      throw ArmError(location() + ": " + why_lost_);
    }
    const Bar bar = connection_->turns.session().bar();
    if (is_final(bar)) throw ArmError(location() + ": " + inverse3::text_of(bar));
    if (bar != Bar::proving && bar != Bar::parking) break;
  }
}

void ServiceArm::start() {
  if (connection_) thread_ = std::thread([this] { run(); });
}

void ServiceArm::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

/// In lock-step the last word alone is the last turn.
void ServiceArm::close() {
  if (connection_) connection_->service->close(WebSocket::Why::in_order, kCloseMs);
  use(nullptr);
}

void ServiceArm::fail(const std::string& why) noexcept {
  failure_ = location() + ": " + why;
  exchange_.fail(kRefused);
}

std::string ServiceArm::text_of(std::uint32_t failure) const {
  if (failure == kRefused) return failure_;
  return failure == ArmExchange::kStalled
             ? location() + ": no turn has ended for long; see what else this machine does"
             : location() + ": no reply has a position of the device; see the vendor's Hub";
}

/// Left out if the terminal or pipe takes nothing: no force may wait for its reader.
void ServiceArm::note(const std::string& text) const noexcept {
  pollfd error_stream{STDERR_FILENO, POLLOUT, 0};
  if (poll(&error_stream, 1, 0) != 1 || (error_stream.revents & POLLOUT) == 0) return;
  std::fprintf(stderr, "kerf-arm: warning: %s: %s\n", location().c_str(), one_line(text).c_str());
}

void ServiceArm::note_once(bool& is_noted, const std::string& text) const noexcept {
  if (!std::exchange(is_noted, true)) note(text);
}

/// One line for each new reason why the device may not push; the user's own doing needs none.
void ServiceArm::note_bar() noexcept {
  const Bar bar = connection_->turns.session().bar();
  if (bar == Bar::none) noted_ = Bar::parking;  // the next one is news again
  if (bar == noted_ || bar == Bar::none || bar == Bar::parking || bar == Bar::proving) return;
  noted_ = bar;
  ++bars_;
  note(inverse3::text_of(bar));
}

void ServiceArm::run() noexcept {
  block_signals();  // an interrupted call would look like a service that is gone
  Overseer::give_crash_stack();
  if (options_.priority > 0) {
    static_cast<void>(pin_to_core(options_.core >= 0 ? options_.core : allowed_cores().back()));
    static_cast<void>(set_fifo(options_.priority));
  }
  while (!exchange_.finished() && !stop_) {
    if (!connection_) {
      if (exchange_.is_let_go()) break;
      reconnect();
    } else if (wait_for_turn() && play_turn() == Turn::lost) {
      drop();
    }
    exchange_.beat();
  }
}

/// False if there is nothing to do yet.
bool ServiceArm::wait_for_turn() noexcept {
  if (in_lockstep()) return exchange_.await_command(monotonic_ns() + kLookNs);
  static_cast<void>(exchange_.await_command(sent_ns_ + TurnGame::kTurnNs));
  return true;
}

ServiceArm::Turn ServiceArm::play_turn() noexcept {
  Connection& link = *connection_;
  take_events();
  const auto command = exchange_.command();
  if (command && command->ticket != ticket_) ++commands_;
  ticket_ = command ? command->ticket : 0;
  sent_ns_ = monotonic_ns();
  MessageBuffer buffer;
  const std::string_view message = link.turns.next(
      command ? command->command : CartesianCommand{},
      command && !in_lockstep() ? command->at_ns : now_ns(), wait_ns(), now_ns(), buffer);
  // What came unasked since the last reply belongs to no turn.
  for (int strays = 0;; ++strays) {
    const WebSocket::Got got = link.service->receive(0);
    if (got == WebSocket::Got::nothing) break;
    if (got == WebSocket::Got::lost) return lose(kClosed);
    if (strays == kMostStrays) {
      return lose("the service sends without being asked; end other programs at its port");
    }
    ++strays_;
  }
  constexpr int kSendMs = static_cast<int>(TurnGame::kDropNs / kNsPerMs);
  if (!link.service->send(message, kSendMs)) return lose(kClosed);
  ++turns_;
  return await_reply();
}

ServiceArm::Turn ServiceArm::await_reply() noexcept {
  Connection& link = *connection_;
  for (;;) {
    const std::int64_t look_ns =
        in_lockstep() ? sent_ns_ + kLockStepPatienceMs * kNsPerMs : link.turns.look_ns();
    const WebSocket::Got got = link.service->receive(look_ns);
    if (got == WebSocket::Got::lost) return lose(kClosed);
    if (got != WebSocket::Got::nothing) {
      const auto took_us = static_cast<std::uint64_t>((monotonic_ns() - sent_ns_) / 1000);
      longest_us_ = std::max<std::uint64_t>(longest_us_, took_us);
      return take_reply(got == WebSocket::Got::text ? link.service->message() : std::string_view());
    }
    const auto wait =
        in_lockstep() ? TurnGame::Wait::lost : link.turns.look(monotonic_ns(), now_ns());
    if (wait == TurnGame::Wait::late) ++late_;
    if (wait == TurnGame::Wait::lost) {
      ++lost_;
      return lose(link.turns.why_lost());
    }
    take_events();
  }
}

ServiceArm::Turn ServiceArm::lose(const std::string& why) noexcept {
  why_lost_ = why;
  return Turn::lost;
}

ServiceArm::Turn ServiceArm::take_reply(std::string_view text) noexcept {
  TurnGame& turns = connection_->turns;
  std::optional<CartesianReport> report;
  const TurnGame::Reply reply = turns.take(text, 0, wait_ns(), now_ns(), report);
  if (reply != TurnGame::Reply::read) ++unreadable_;
  if (reply == TurnGame::Reply::lost) return lose(turns.why_lost());
  if (reply == TurnGame::Reply::unread) return Turn::done;
  note_bar();
  if (is_final(turns.session().bar())) {
    fail(inverse3::text_of(turns.session().bar()));
    return Turn::done;
  }
  if (report) pass_on(*report);
  return Turn::done;
}

void ServiceArm::pass_on(const CartesianReport& report) noexcept {
  exchange_.publish(report);
  ++packets_;
}

void ServiceArm::take_events() noexcept {
  Connection& link = *connection_;
  if (!link.events) return;
  for (int taken = 0; taken < kMostEvents; ++taken) {
    const WebSocket::Got got = link.events->receive(0);
    if (got == WebSocket::Got::nothing) return;
    if (got == WebSocket::Got::lost) {
      link.events.reset();
      return note("the service's events ended; its own faults show only in the device's state");
    }
    inverse3::ServiceEvent event;
    try {
      if (got != WebSocket::Got::text || !parse_event(link.events->message(), event)) continue;
    } catch (const std::bad_alloc&) {
      continue;
    }
    const bool is_ours = event.device_id.view().empty() ||
                         event.device_id == link.turns.session().device_id().view();
    const bool is_fault = event.name == "device-disconnected" ||
                          event.safety_type == "ebrake_triggered" ||
                          event.safety_type == "stall_detected";
    if (is_ours && is_fault) {
      link.turns.session().raise(Bar::event, now_ns());
      note_bar();
    }
  }
}

/// The connection is of no use: its last word first. The servo hears of it at once, not only by the
/// silence. The next attempt is made at once, since the device may still have kerf's force; but not
/// if the connection was a short one, as of a service that ends each of them.
void ServiceArm::drop() noexcept {
  Connection& link = *connection_;
  link.service->say_last_word();
  pass_on(link.turns.session().farewell(0));
  link.service->close(WebSocket::Why::protocol, kDroppedCloseMs);
  const std::int64_t now_ns = monotonic_ns();
  const bool was_short = now_ns - link.began_ns < TurnGame::kFirstBackoffNs;
  use(nullptr);
  noted_ = Bar::parking;
  backoff_ns_ = TurnGame::kFirstBackoffNs;
  retry_ns_ = was_short ? now_ns + backoff_ns_ : now_ns;
  if (was_short) backoff_ns_ *= 2;
  noted_failure_.clear();
  note("the connection is lost and tried again: " + why_lost_);
}

void ServiceArm::reconnect() noexcept {
  sleep_until_ns(std::min(retry_ns_, monotonic_ns() + kLookNs));
  if (stop_ || exchange_.is_let_go() || monotonic_ns() < retry_ns_) return;
  try {
    use(connect(stop_));
    ++reconnections_;
  } catch (const Refusal& refusal) {
    fail(refusal.what());
  } catch (const std::exception& error) {
    if (!stop_ && noted_failure_ != error.what()) {
      noted_failure_ = error.what();
      note("not connected again yet: " + noted_failure_);
    }
    retry_ns_ = monotonic_ns() + backoff_ns_;
    backoff_ns_ = std::min(2 * backoff_ns_, TurnGame::kLongestBackoffNs);
  }
}

std::vector<std::pair<std::string, std::uint64_t>> ServiceArm::errors() const {
  return {{"packets", packets_},
          {"commands", commands_},
          {"late_replies", late_},
          {"lost_replies", lost_},
          {"unreadable_replies", unreadable_},
          {"stray_replies", strays_},
          {"bars", bars_},
          {"reconnections", reconnections_},
          {"longest_turn_us", longest_us_}};
}

}  // namespace kerf
