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

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/cartesian.hpp"

namespace kerf::inverse3 {
namespace {

constexpr int kMostStrays = 64, kMostEvents = 16;  // in a turn: a flood cannot hold the force
constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kLookNs = 20 * kNsPerMs;  ///< longest delay of the end
constexpr int kConnectMs = 1000;
constexpr int kCloseMs = 100;
constexpr int kLockStepPatienceMs = 2000;

constexpr const char* kNeeds =
    "needs the vendor's Inverse Service 3.1 or newer: systemctl status haply-inverse-service";

// Why a connection is lost.
constexpr const char* kClosed =
    "the service has closed the connection; see systemctl status haply-inverse-service, and end "
    "other programs that use it";
constexpr const char* kSilent =
    "the service has not replied for 100 ms; see what else this machine does, and systemctl status "
    "haply-inverse-service";
constexpr const char* kNoState =
    "they are no JSON of a state; see which service it is by systemctl status "
    "haply-inverse-service";

/// A reason for which no later try can help.
struct Refusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

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

/// "3.5.0.0" as 305; nothing for another text.
std::optional<int> version_of(std::string_view text) {
  int parts[2]{};
  for (int& part : parts) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), part);
    if (error != std::errc{} || part < 0 || part > 99) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (&part == parts && !text.starts_with('.')) return std::nullopt;
    if (!text.empty()) text.remove_prefix(1);
  }
  return parts[0] * 100 + parts[1];
}

/// The number in the answer to a setting, whose envelope is not documented: alone, or as a member
/// of one of these names.
std::optional<double> setting_within(const Json& value) {
  return value.visit([&](const auto& held) -> std::optional<double> {
    using T = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::int64_t> ||
                  std::is_same_v<T, std::uint64_t>) {
      return static_cast<double>(held);
    } else if constexpr (std::is_same_v<T, Json::Members>) {
      for (const char* name : {"value", "force_scale", "devices/force_scale", "data"}) {
        if (value.contains(name)) return setting_within(value.at(name));
      }
    }
    return std::nullopt;
  });
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

std::int64_t ServicePort::now_ns() const noexcept {
  if (!ours_.lockstep) return monotonic_ns();
  return static_cast<std::int64_t>(turns_) * (kNsPerSecond / ours_.rate_hz);
}

ForceKey ServicePort::read_version(const std::atomic<bool>& stop) const {
  const HttpAnswer answer = http_get(options_.service, "/version", kConnectMs, stop);
  std::string version;
  LinkHello theirs{Personality::inverse3, false, ours_.rate_hz};
  try {
    const Json json = Json::parse(answer.body);
    version = json.at("project_version").get<std::string>();
    if (json.contains("kerf_emulator")) {  // the emulated service says how it runs
      theirs.lockstep = json.at("kerf_emulator").at("lockstep").get<bool>();
      theirs.rate_hz = json.at("kerf_emulator").at("rate_hz").get<int>();
    }
  } catch (const JsonError&) {
    throw Refusal("what answers there gives no version of an Inverse Service (HTTP " +
                  std::to_string(answer.status) + "); " + kNeeds);
  }
  const std::string reason = discord(ours_, theirs);
  if (!reason.empty()) throw Refusal(reason);
  const auto number = version_of(version);
  if (!number || *number < 301) throw Refusal("version " + one_line(version) + "; " + kNeeds);
  return *number >= 305 ? ForceKey::vector : ForceKey::values;
}

/// At each connection: another client may have changed it since the last one. Later in a connection
/// the echo shows it.
void ServicePort::check_force_scale(const std::atomic<bool>& stop) {
  std::optional<double> scale;
  try {
    const HttpAnswer answer =
        http_get(options_.service, "/settings/devices/force_scale", kConnectMs, stop);
    if (answer.status == 200) scale = setting_within(Json::parse(answer.body));
  } catch (const std::exception&) {  // settings are read where there are some
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
  const ForceKey key = read_version(stop);
  if (key == ForceKey::vector) check_force_scale(stop);
  auto made = std::make_unique<Connection>();
  made->service = std::make_unique<WebSocket>(options_.service, kConnectMs, stop);
  // The service speaks first.
  const std::int64_t until_ns = monotonic_ns() + kConnectMs * kNsPerMs;
  WebSocket::Got got{};
  do {
    got = made->service->receive(std::min(until_ns, monotonic_ns() + kLookNs));
  } while (got == WebSocket::Got::nothing && !stop && monotonic_ns() < until_ns);
  if (got != WebSocket::Got::text) {
    throw std::runtime_error(std::string("the service sends no list of its devices; ") + kNeeds);
  }
  ServiceState first;
  if (!parse_state(made->service->message(), first)) {
    throw std::runtime_error(std::string("the list of the devices cannot be read; ") + kNeeds);
  }
  made->session = std::make_unique<Session>(options_.wanted, key, first, now_ns());
  if (is_final(made->session->bar())) throw Refusal(text_of(made->session->bar()));
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
      options_.wanted.device_id = connection_->session->device_id();
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
    const Bar bar = connection_->session->bar();
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
  const Bar bar = connection_->session->bar();
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
  const std::int64_t pause_ns = ours_.lockstep ? kLookNs : kTurnNs;
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
  CartesianCommand neutral;
  std::array<std::uint8_t, MailboxPacket::kMaxBytes> packet;
  const std::size_t size = outbox_.take(packet);
  if (const auto command = decode_cartesian_command(std::span(packet).first(size))) {
    command_ = *command;
    command_ns_ = ours_.lockstep ? now_ns() : put_ns_.load(std::memory_order_relaxed);
    ++commands_;
  }
  const bool takes_back = std::exchange(link.takes_back, false);
  const auto force_n =
      link.session->force_n(takes_back ? neutral : command_, command_ns_, now_ns());
  const bool names_itself = link.turns == 0 && link.session->key() == ForceKey::vector;
  const Extra extra = names_itself                        ? Extra::profile
                      : link.turns % kFullStateTurns == 1 ? Extra::full_state
                                                          : Extra::none;
  MessageBuffer buffer;
  const std::string_view message =
      force_message(link.session->device_id(), link.session->key(), force_n, extra, buffer);
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
  sent_ns_ = monotonic_ns();
  if (!link.service->send(message, static_cast<int>(kDropNs / kNsPerMs))) return lose(kClosed);
  outbox_.set_on_its_way(false);
  ++turns_;
  ++link.turns;
  return await_reply(sent_ns_);
}

ServicePort::Turn ServicePort::await_reply(std::int64_t sent_ns) noexcept {
  Connection& link = *connection_;
  const std::array<std::int64_t, 3> limits =
      ours_.lockstep ? std::array<std::int64_t, 3>{kLockStepPatienceMs * kNsPerMs,
                                                   kLockStepPatienceMs * kNsPerMs,
                                                   kLockStepPatienceMs * kNsPerMs}
                     : std::array{kLateNs, kTakeBackNs, kDropNs};
  for (std::size_t passed = 0;; ++passed) {
    const WebSocket::Got got =
        link.service->receive(sent_ns + limits[std::min<std::size_t>(passed, 2)]);
    if (got == WebSocket::Got::lost) return lose(kClosed);
    if (got != WebSocket::Got::nothing) {
      const auto took_us = static_cast<std::uint64_t>((monotonic_ns() - sent_ns) / 1000);
      longest_us_ = std::max<std::uint64_t>(longest_us_, took_us);
      if (got == WebSocket::Got::binary) break;
      // This thread itself may have been held up; then the reply was there on waking up.
      if (!ours_.lockstep && monotonic_ns() - sent_ns > kTakeBackNs && passed < 2) {
        link.takes_back = true;
        link.session->raise(Bar::stalled, now_ns());
      }
      return take_reply();
    }
    if (passed == 0) ++late_;
    if (passed == 1) {
      link.takes_back = true;
      link.session->raise(Bar::stalled, now_ns());
    }
    if (passed == 2) {
      ++lost_;
      return lose(kSilent);
    }
    take_events();
  }
  return count_unread(kNoState);
}

ServicePort::Turn ServicePort::lose(const char* why) noexcept {
  why_lost_ = why;
  return Turn::lost;
}

ServicePort::Turn ServicePort::count_unread(const std::string& why) noexcept {
  ++unreadable_;
  if (++connection_->unread < kMostUnread) return Turn::done;
  why_lost_ =
      std::to_string(kMostUnread) + " replies of the service in a row cannot be read: " + why;
  return Turn::lost;
}

ServicePort::Turn ServicePort::take_reply() noexcept {
  Connection& link = *connection_;
  std::optional<CartesianReport> report;
  bool is_read = false;
  try {
    is_read = parse_state(link.service->message(), state_);
    if (is_read) report = link.session->take(state_, number_ + 1, now_ns());
  } catch (const std::bad_alloc&) {
    is_read = false;
  }
  if (!is_read) return count_unread(kNoState);
  if (!report && !is_absent(link.session->bar())) return count_unread(link.session->why_unread());
  link.unread = 0;
  note_bar();
  if (is_final(link.session->bar())) {
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
    const bool is_ours =
        event.device_id.view().empty() || event.device_id == link.session->device_id().view();
    const bool is_fault = event.name == "device-disconnected" ||
                          event.safety_type == "ebrake_triggered" ||
                          event.safety_type == "stall_detected";
    if (is_ours && is_fault) {
      link.session->raise(Bar::event, now_ns());
      note_bar();
    }
  }
}

/// The connection is of no use. The servo hears of it at once, not only by the silence.
void ServicePort::drop() noexcept {
  pass_on(connection_->session->farewell(number_ + 1));
  connection_.reset();
  command_ = {};
  noted_ = Bar::parking;
  backoff_ns_ = kFirstBackoffNs;
  retry_ns_ = monotonic_ns() + backoff_ns_;
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
    backoff_ns_ = std::min(2 * backoff_ns_, kLongestBackoffNs);
    retry_ns_ = monotonic_ns() + backoff_ns_;
  }
}

/// The last turns have no force.
void ServicePort::end() noexcept {
  const std::int64_t until_ns = monotonic_ns() + kLastPacketMs * kNsPerMs;
  while (connection_ && monotonic_ns() < until_ns) {
    connection_->takes_back = true;
    if (play_turn() == Turn::lost) {
      connection_.reset();
      break;
    }
    if (ours_.lockstep) break;
    sleep_until_ns(sent_ns_ + kTurnNs);
  }
  outbox_.set_on_its_way(false);
  if (connection_) connection_->service->close(kCloseMs);
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
