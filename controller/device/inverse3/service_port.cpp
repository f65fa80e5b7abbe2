// SPDX-License-Identifier: Apache-2.0
#include "controller/device/inverse3/service_port.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <system_error>

#include <poll.h>
#include <unistd.h>

#include "controller/device/inverse3/service_answers.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/cartesian.hpp"

namespace kerf::inverse3 {
namespace {

constexpr int kMostStrays = 64, kMostEvents = 16;  // in a turn: a flood cannot hold the force
constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kLookNs = 20 * kNsPerMs;  ///< longest delay of the end
constexpr int kConnectMs = 1000;
constexpr int kCloseMs = 100, kDroppedCloseMs = 20;
constexpr int kLockStepPatienceMs = 2000;

constexpr const char* kClosed =
    "the service has closed the connection; see systemctl status haply-inverse-service, and end "
    "other programs that use it";

[[noreturn]] void refuse_text(std::string_view text) {
  throw std::runtime_error(
      "--port ws" + std::string(text) +
      ": not [:[HOST:]PORT][,park=NAME][,device=ID][,handle=ID][,events=PORT]; give ws alone for "
      "the service of this machine");
}

std::optional<std::uint16_t> port_number(std::string_view text) {
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

HostPort host_port(std::string_view text, std::string_view whole) {
  HostPort out;
  const std::size_t colon = text.rfind(':');
  std::string_view host = colon == std::string_view::npos ? "" : text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const auto port = port_number(text.substr(colon == std::string_view::npos ? 0 : colon + 1));
  if (!port || *port == 0 || (colon != std::string_view::npos && host.empty())) refuse_text(whole);
  if (!host.empty()) out.host = host;
  out.port = *port;
  return out;
}

}  // namespace

ServiceOptions parse_service_port(std::string_view text) {
  ServiceOptions options;
  const std::string_view whole = text;
  bool has_events = false;
  if (text.starts_with(':')) {
    const std::size_t end = std::min(text.find(','), text.size());
    options.service = host_port(text.substr(1, end - 1), whole);
    text.remove_prefix(end);
  }
  while (!text.empty()) {
    text.remove_prefix(1);  // the comma
    const std::string_view word = text.substr(0, std::min(text.find(','), text.size()));
    text.remove_prefix(word.size());
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string_view name = word.substr(0, equals);
    const ShortText value(word.substr(std::min(equals + 1, word.size())));
    if (!value.is_plain()) refuse_text(whole);
    if (name == "park") {
      options.wanted.park = value;
    } else if (name == "device") {
      options.wanted.device_id = value;
    } else if (name == "handle") {
      options.wanted.handle_id = value;
    } else if (const auto port = port_number(value.view()); name == "events" && port) {
      options.event_port = *port;
      has_events = true;
    } else {
      refuse_text(whole);
    }
  }
  if (!has_events && options.service.port != kServicePort) options.event_port = 0;
  return options;
}

ServicePort::ServicePort(const ServiceOptions& options, const LinkHello& ours, int patience_ms,
                         const std::atomic<bool>& stop, IoThread io)
    : options_(options), ours_(ours), io_(io) {
  connect_within(patience_ms, stop);
  prove();
  sem_init(&raised_, 0, 0);
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error&) {
    sem_destroy(&raised_);
    throw;
  }
}

ServicePort::~ServicePort() {
  stop_ = true;
  sem_post(&raised_);
  if (thread_.joinable()) thread_.join();
  sem_destroy(&raised_);
}

std::string ServicePort::place() const {
  return "--port ws:" + options_.service.host + ":" + std::to_string(options_.service.port);
}

std::int64_t ServicePort::wait_ns() const noexcept {
  return ours_.lockstep ? 0 : monotonic_ns();
}

std::int64_t ServicePort::now_ns() const noexcept {
  if (!ours_.lockstep) return monotonic_ns();
  return static_cast<std::int64_t>(turns_) * (kNsPerSecond / ours_.rate_hz);
}

/// At each connection: another client may have changed it since the last one. Later in a connection
/// the echo shows it.
void ServicePort::check_force_scale(const std::atomic<bool>& stop) {
  std::optional<double> scale;
  try {
    scale = force_scale_of(
        http_get(options_.service, "/settings/devices/force_scale", kConnectMs, stop));
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

std::unique_ptr<ServicePort::Connection> ServicePort::connect(const std::atomic<bool>& stop) {
  const ForceKey key =
      force_key_of(http_get(options_.service, "/version", kConnectMs, stop), ours_);
  std::unique_ptr<WebSocket> service;
  try {
    service = std::make_unique<WebSocket>(options_.service, kConnectMs, stop);
  } catch (const UpgradeRefused& refused) {
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
  if (is_final(session.bar())) throw Refusal(text_of(session.bar()));
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

void ServicePort::connect_within(int patience_ms, const std::atomic<bool>& stop) {
  const std::int64_t give_up_ns = monotonic_ns() + patience_ms * kNsPerMs;
  for (;;) {
    try {
      connection_ = connect(stop);
      // From now on it is this device, whatever else appears.
      options_.wanted.device_id = connection_->turns.session().device_id();
      options_.wanted.is_again = true;
      return;
    } catch (const Refusal& refusal) {
      throw std::runtime_error(place() + ": " + refusal.what());
    } catch (const std::runtime_error& error) {
      if (stop || monotonic_ns() >= give_up_ns) {
        const std::string why = error.what();
        const bool has_way_out = why.find(';') != std::string::npos;
        throw std::runtime_error(place() + ": " + why +
                                 (has_way_out ? "" : std::string("; ") + kNeeds));
      }
    }
    sleep_until_ns(std::min(monotonic_ns() + 50 * kNsPerMs, give_up_ns));
  }
}

/// Plays the turns of the proof, so that a service of another key is refused at the start. A device
/// that is not well proves it later.
void ServicePort::prove() {
  for (int turn = 0; turn < Session::kProofTurns; ++turn) {
    // The service's state may be older than a turn on a fast link: 50 ms in all.
    constexpr std::int64_t kPauseNs = 5 * kNsPerMs;
    if (!ours_.lockstep && turn > 0) sleep_until_ns(sent_ns_ + kPauseNs);
    if (play_turn() == Turn::lost) {
      throw std::runtime_error(place() + ": " + one_line(why_lost_));
    }
    const Bar bar = connection_->turns.session().bar();
    if (is_final(bar)) throw std::runtime_error(place() + ": " + text_of(bar));
    if (bar != Bar::proving && bar != Bar::parking) break;
  }
  if (!ours_.lockstep) return;
  // In lock-step each report is a tick: the newest one waits for the first, as of a device that
  // speaks first. More than one would be read together or apart, as chance has it.
  std::array<std::uint8_t, MailboxPacket::kMaxBytes> packet, newest;
  std::size_t size = 0;
  while (const std::size_t taken = inbox_.take(packet)) {
    newest = packet;
    size = taken;
  }
  if (size > 0) static_cast<void>(inbox_.put(std::span(newest).first(size)));
}

bool ServicePort::send(std::span<const std::uint8_t> packet) noexcept {
  if (!ours_.lockstep) put_ns_.store(monotonic_ns(), std::memory_order_relaxed);
  if (closed() || !outbox_.put(packet)) return false;
  sem_post(&raised_);
  return true;
}

/// Left out if the terminal or pipe takes nothing: no force may wait for its reader.
void ServicePort::note(const std::string& text) const noexcept {
  pollfd error_stream{STDERR_FILENO, POLLOUT, 0};
  if (poll(&error_stream, 1, 0) != 1 || (error_stream.revents & POLLOUT) == 0) return;
  std::fprintf(stderr, "kerf: warning: %s: %s\n", place().c_str(), one_line(text).c_str());
}

void ServicePort::note_once(bool& is_noted, const std::string& text) const noexcept {
  if (!std::exchange(is_noted, true)) note(text);
}

/// One line for each new reason why the device may not push; the user's own doing needs none.
void ServicePort::note_bar() noexcept {
  const Bar bar = connection_->turns.session().bar();
  if (bar == Bar::none) noted_ = Bar::parking;  // the next one is news again
  if (bar == noted_ || bar == Bar::none || bar == Bar::parking || bar == Bar::proving) return;
  noted_ = bar;
  ++bars_;
  note(text_of(bar));
}

void ServicePort::run() noexcept {
  block_signals();  // an interrupted call would look like a service that is gone
  sender_id_ = gettid();
  become(io_);
  while (!stop_ && !closed()) {
    if (!connection_) {
      reconnect();
    } else if (wait_for_turn()) {
      if (play_turn() == Turn::lost) drop();
      outbox_.set_on_its_way(false);
    }
  }
  end();
}

/// False if there is nothing to do yet.
bool ServicePort::wait_for_turn() noexcept {
  const std::int64_t pause_ns = ours_.lockstep ? kLookNs : TurnGame::kTurnNs;
  const std::int64_t due_ns = ours_.lockstep ? monotonic_ns() + pause_ns : sent_ns_ + pause_ns;
  const timespec until{due_ns / kNsPerSecond, due_ns % kNsPerSecond};
  while (outbox_.empty() && !stop_) {
    if (sem_clockwait(&raised_, CLOCK_MONOTONIC, &until) != 0) break;  // no signal comes here
  }
  return !stop_ && (!ours_.lockstep || !outbox_.empty());
}

ServicePort::Turn ServicePort::play_turn() noexcept {
  Connection& link = *connection_;
  take_events();
  std::array<std::uint8_t, MailboxPacket::kMaxBytes> packet;
  const std::size_t size = outbox_.take(packet);
  if (const auto command = decode_cartesian_command(std::span(packet).first(size))) {
    command_ = *command;
    command_ns_ = ours_.lockstep ? now_ns() : put_ns_.load(std::memory_order_relaxed);
    ++commands_;
  }
  sent_ns_ = monotonic_ns();
  MessageBuffer buffer;
  const std::string_view message =
      link.turns.next(command_, command_ns_, wait_ns(), now_ns(), buffer);
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
  outbox_.set_on_its_way(false);
  ++turns_;
  return await_reply();
}

ServicePort::Turn ServicePort::await_reply() noexcept {
  Connection& link = *connection_;
  for (;;) {
    const std::int64_t look_ns =
        ours_.lockstep ? sent_ns_ + kLockStepPatienceMs * kNsPerMs : link.turns.look_ns();
    const WebSocket::Got got = link.service->receive(look_ns);
    if (got == WebSocket::Got::lost) return lose(kClosed);
    if (got != WebSocket::Got::nothing) {
      const auto took_us = static_cast<std::uint64_t>((monotonic_ns() - sent_ns_) / 1000);
      longest_us_ = std::max<std::uint64_t>(longest_us_, took_us);
      return take_reply(got == WebSocket::Got::text ? link.service->message() : std::string_view());
    }
    const auto wait =
        ours_.lockstep ? TurnGame::Wait::lost : link.turns.look(monotonic_ns(), now_ns());
    if (wait == TurnGame::Wait::late) ++late_;
    if (wait == TurnGame::Wait::lost) {
      ++lost_;
      return lose(link.turns.why_lost());
    }
    take_events();
  }
}

ServicePort::Turn ServicePort::lose(const std::string& why) noexcept {
  why_lost_ = why;
  return Turn::lost;
}

ServicePort::Turn ServicePort::take_reply(std::string_view text) noexcept {
  TurnGame& turns = connection_->turns;
  std::optional<CartesianReport> report;
  const TurnGame::Reply reply = turns.take(text, number_ + 1, wait_ns(), now_ns(), report);
  if (reply != TurnGame::Reply::read) ++unreadable_;
  if (reply == TurnGame::Reply::lost) return lose(turns.why_lost());
  if (reply == TurnGame::Reply::unread) return Turn::done;
  note_bar();
  if (is_final(turns.session().bar())) {
    closed_ = true;
    return Turn::done;
  }
  if (report) pass_on(*report);
  return Turn::done;
}

/// Numbers count what the servo could read: what it is too late for is counted as overflow alone.
void ServicePort::pass_on(const CartesianReport& report) noexcept {
  const bool is_put = inbox_.put(encode(report));
  number_ += is_put ? 1 : 0;
  ++(is_put ? packets_ : overflow_);
}

void ServicePort::take_events() noexcept {
  Connection& link = *connection_;
  if (!link.events) return;
  for (int taken = 0; taken < kMostEvents; ++taken) {
    const WebSocket::Got got = link.events->receive(0);
    if (got == WebSocket::Got::nothing) return;
    if (got == WebSocket::Got::lost) {
      link.events.reset();
      return note("the service's events ended; its own faults show only in the device's state");
    }
    ServiceEvent event;
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
void ServicePort::drop() noexcept {
  Connection& link = *connection_;
  link.service->say_last_word();
  pass_on(link.turns.session().farewell(number_ + 1));
  link.service->close(WebSocket::Why::protocol, kDroppedCloseMs);
  const std::int64_t now_ns = monotonic_ns();
  const bool was_short = now_ns - link.began_ns < kFirstBackoffNs;
  connection_.reset();
  command_ = {};
  noted_ = Bar::parking;
  backoff_ns_ = kFirstBackoffNs;
  retry_ns_ = was_short ? now_ns + backoff_ns_ : now_ns;
  if (was_short) backoff_ns_ *= 2;
  noted_failure_.clear();
  note("the connection is lost and tried again for as long as the program waits: " + why_lost_);
}

void ServicePort::reconnect() noexcept {
  const std::int64_t look_ns = std::min(retry_ns_, monotonic_ns() + kLookNs);
  const timespec until{look_ns / kNsPerSecond, look_ns % kNsPerSecond};
  std::array<std::uint8_t, MailboxPacket::kMaxBytes> packet;
  while (!stop_ && sem_clockwait(&raised_, CLOCK_MONOTONIC, &until) == 0) {
    static_cast<void>(outbox_.take(packet));  // for a device that is gone
    outbox_.set_on_its_way(false);
  }
  if (stop_ || monotonic_ns() < retry_ns_) return;
  try {
    connection_ = connect(stop_);
    ++reconnections_;
  } catch (const Refusal& refusal) {
    note(refusal.what());
    closed_ = true;
  } catch (const std::exception& error) {
    if (!stop_ && noted_failure_ != error.what()) {
      noted_failure_ = error.what();
      note("not connected again yet: " + noted_failure_);
    }
    retry_ns_ = monotonic_ns() + backoff_ns_;
    backoff_ns_ = std::min(2 * backoff_ns_, kLongestBackoffNs);
  }
}

/// The last turns have no force; in lock-step the last word alone is the last turn.
void ServicePort::end() noexcept {
  const std::int64_t until_ns = monotonic_ns() + kLastPacketMs * kNsPerMs;
  while (connection_ && !ours_.lockstep && monotonic_ns() < until_ns) {
    connection_->turns.take_back();
    if (play_turn() == Turn::lost) {
      connection_.reset();
      break;
    }
    sleep_until_ns(sent_ns_ + TurnGame::kTurnNs);
  }
  outbox_.set_on_its_way(false);
  if (connection_) connection_->service->close(WebSocket::Why::in_order, kCloseMs);
  closed_ = true;
}

std::vector<LinkCounter> ServicePort::counters() const {
  return {
      {"packets", packets_},           {"overflow", overflow_}, {"commands", commands_},
      {"late_replies", late_},         {"lost_replies", lost_}, {"unreadable_replies", unreadable_},
      {"stray_replies", strays_},      {"bars", bars_},         {"reconnections", reconnections_},
      {"longest_turn_us", longest_us_}};
}

}  // namespace kerf::inverse3
