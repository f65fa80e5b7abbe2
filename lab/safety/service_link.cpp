// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/service_link.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace kerf::faults {
namespace {

constexpr std::int64_t kCycleNs = 1'000'000'000 / kCyclesPerSecond;

ServiceFault fault_of(const FaultyDevice::ServiceChange& change) {
  switch (change.kind) {
    case FaultKind::closing:
      return ServiceFault::close;
    case FaultKind::half_close:
      return ServiceFault::half_close;
    case FaultKind::both_closed:
      return ServiceFault::fin;
    default:
      return change.begins ? ServiceFault::unreadable : ServiceFault::readable;
  }
}

}  // namespace

using inverse3::ForceKey;
using inverse3::TurnGame;

ServiceLink::ServiceLink(FaultyDevice& device, std::uint32_t seed)
    : device_(device), service_({.first_way = static_cast<int>(seed % kMalformedWays)}, device) {
  connect();
  if (!game_) throw std::runtime_error("the emulated service lists no device");
}

std::int64_t ServiceLink::now_ns() const noexcept {
  return cycle_ * kCycleNs;
}

/// The service greets a client with the state of its devices, which takes one cycle.
void ServiceLink::connect() {
  const std::string first = service_.greet();
  ++cycle_;
  command_ = {};
  has_news_ = is_waiting_ = false;
  inverse3::ServiceState state;
  try {
    if (parse_state(first, state)) {
      const inverse3::Wanted wanted{.device_id = device_id_,
                                    .is_again = !device_id_.view().empty()};
      game_.emplace(wanted, ForceKey::vector, state, now_ns());
      device_id_ = game_->session().device_id();
      began_ns_ = now_ns();
      return;
    }
  } catch (const std::runtime_error&) {  // thrown if the device is not listed
  }
  retry_ns_ = now_ns() + backoff_ns_;
  backoff_ns_ = std::min(2 * backoff_ns_, TurnGame::kLongestBackoffNs);
}

void ServiceLink::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto command = decode_cartesian_command(packet);
  if (!command || !game_) return;
  command_ = *command;
  command_ns_ = now_ns();
  has_news_ = true;
}

void ServiceLink::advance(int cycles) noexcept {
  has_failed_ = has_left_pushing_ = false;
  for (int i = 0; i < cycles; ++i) cycle();
}

/// A reply that cannot be read does not end a connection by itself: three of them do.
void ServiceLink::begin_faults() {
  while (const auto change = device_.take_service_change()) {
    if (!change->begins && change->kind != FaultKind::unreadable) continue;  // of a moment
    service_.begin(fault_of(*change));
    has_failed_ = has_failed_ || change->begins;
  }
  const auto fault = service_.take_link_fault();
  if (fault && game_) drop(*fault != ServiceFault::fin);
}

void ServiceLink::cycle() {
  begin_faults();
  if (game_ && service_.hung_up()) drop(true);
  if (std::exchange(owes_word_, false)) {
    inverse3::MessageBuffer buffer;
    service_.receive(inverse3::last_word(device_id_, ForceKey::vector, buffer));
    has_left_pushing_ = service_.is_pushed();
    ++cycle_;
    return;
  }
  if (!game_ && !service_.hung_up() && now_ns() >= retry_ns_) return connect();
  const bool is_due =
      game_ && !is_waiting_ && (has_news_ || now_ns() - sent_ns_ >= TurnGame::kTurnNs);
  if (is_due) {
    play_turn();
  } else {
    service_.advance(1);
  }
  ++cycle_;
  if (is_waiting_) await_reply();
}

void ServiceLink::play_turn() {
  while (service_.next_reply()) {
  }  // discards what the service sent unasked
  sent_ns_ = now_ns();
  has_news_ = false;
  is_waiting_ = true;
  ++turns_;
  inverse3::MessageBuffer buffer;
  service_.receive(game_->next(command_, command_ns_, now_ns(), now_ns(), buffer));
}

void ServiceLink::await_reply() {
  if (const auto reply = service_.next_reply()) return take(*reply);
  while (now_ns() >= game_->look_ns()) {
    if (game_->look(now_ns(), now_ns()) == TurnGame::Wait::lost) return drop(true);
  }
}

void ServiceLink::take(const ServiceMessage& reply) {
  is_waiting_ = false;
  std::optional<CartesianReport> report;
  const std::string_view text = reply.is_binary ? std::string_view() : reply.text;
  const auto read = game_->take(text, number_ + 1, now_ns(), now_ns(), report);
  if (read == TurnGame::Reply::lost) drop(true);
  if (report) pass_on(*report);
}

void ServiceLink::pass_on(const CartesianReport& report) {
  ++number_;
  reports_.push_back(encode(report));
}

/// As `ServiceArm::drop`.
void ServiceLink::drop(bool carries_a_word) {
  pass_on(game_->session().farewell(number_ + 1));
  game_.reset();
  is_waiting_ = false;
  owes_word_ = carries_a_word;
  const bool was_short = now_ns() - began_ns_ < TurnGame::kFirstBackoffNs;
  backoff_ns_ = TurnGame::kFirstBackoffNs;
  retry_ns_ = now_ns() + (was_short ? backoff_ns_ : 0);
  if (was_short) backoff_ns_ *= 2;
}

std::span<const std::uint8_t> ServiceLink::next_packet() noexcept {
  if (reports_.empty()) return {};
  handed_out_ = reports_.front();
  reports_.pop_front();
  return handed_out_;
}

}  // namespace kerf::faults
