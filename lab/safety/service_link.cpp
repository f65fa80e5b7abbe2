// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/service_link.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "controller/device/inverse3/service_port.hpp"

namespace kerf::faults {
namespace {

constexpr std::int64_t kCycleNs = 1'000'000'000 / kCyclesPerSecond;

}  // namespace

using inverse3::Bar;
using inverse3::ServicePort;

ServiceLink::ServiceLink(PacketDevice& device) : service_({}, device) {
  connect();
  if (!session_) throw std::runtime_error("the emulated service lists no device");
}

std::int64_t ServiceLink::now_ns() const noexcept {
  return cycle_ * kCycleNs;
}

/// The service greets a client with the state of its devices, which takes one cycle.
void ServiceLink::connect() {
  const std::string first = service_.greet();
  ++cycle_;
  command_ = {};
  has_news_ = is_waiting_ = takes_back_ = false;
  unread_ = 0;
  try {
    if (parse_state(first, state_)) {
      session_.emplace(inverse3::Wanted{}, inverse3::ForceKey::vector, state_, now_ns());
      backoff_ns_ = ServicePort::kFirstBackoffNs;
      return;
    }
  } catch (const std::runtime_error&) {  // thrown if the device is not listed
  }
  retry_ns_ = now_ns() + backoff_ns_;
  backoff_ns_ = std::min(2 * backoff_ns_, ServicePort::kLongestBackoffNs);
}

void ServiceLink::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto command = decode_cartesian_command(packet);
  if (!command || !session_) return;
  command_ = *command;
  command_ns_ = now_ns();
  has_news_ = true;
}

void ServiceLink::advance(int cycles) noexcept {
  for (int i = 0; i < cycles; ++i) cycle();
}

void ServiceLink::cycle() {
  if (session_ && service_.hung_up()) drop();
  if (!session_ && !service_.hung_up() && now_ns() >= retry_ns_) return connect();
  const bool is_due =
      session_ && !is_waiting_ && (has_news_ || now_ns() - sent_ns_ >= ServicePort::kTurnNs);
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
  const bool takes_back = std::exchange(takes_back_, false);
  const auto force_n =
      session_->force_n(takes_back ? CartesianCommand{} : command_, command_ns_, now_ns());
  const auto extra = turns_ % ServicePort::kFullStateTurns == 1 ? inverse3::Extra::full_state
                                                                : inverse3::Extra::none;
  inverse3::MessageBuffer buffer;
  sent_ns_ = now_ns();
  has_news_ = is_late_ = false;
  is_waiting_ = true;
  ++turns_;
  service_.receive(force_message(session_->device_id(), session_->key(), force_n, extra, buffer));
}

void ServiceLink::await_reply() {
  const auto reply = service_.next_reply();
  const std::int64_t took_ns = now_ns() - sent_ns_;
  if (took_ns >= ServicePort::kTakeBackNs && !std::exchange(is_late_, true)) {
    takes_back_ = true;
    session_->raise(Bar::stalled, now_ns());
  }
  if (reply) {
    take(*reply);
  } else if (took_ns >= ServicePort::kDropNs) {
    drop();
  }
}

void ServiceLink::take(const ServiceMessage& reply) {
  is_waiting_ = false;
  std::optional<CartesianReport> report;
  const bool is_read = !reply.is_binary && parse_state(reply.text, state_);
  if (is_read) report = session_->take(state_, number_ + 1, now_ns());
  if (!is_read || (!report && session_->bar() != Bar::gone)) {
    if (++unread_ >= ServicePort::kMostUnread) drop();
    return;
  }
  unread_ = 0;
  if (report) pass_on(*report);
}

void ServiceLink::pass_on(const CartesianReport& report) {
  ++number_;
  reports_.push_back(encode(report));
}

void ServiceLink::drop() {
  pass_on(session_->farewell(number_ + 1));
  session_.reset();
  is_waiting_ = false;
  retry_ns_ = now_ns() + backoff_ns_;
}

std::span<const std::uint8_t> ServiceLink::next_packet() noexcept {
  if (reports_.empty()) return {};
  handed_out_ = reports_.front();
  reports_.pop_front();
  return handed_out_;
}

}  // namespace kerf::faults
