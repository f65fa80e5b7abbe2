// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/firewire_node.hpp"

#include <algorithm>
#include <cerrno>

#include <poll.h>

namespace kerf {

void FirewireNode::open(FileHandle open, int file) {
  const std::uint32_t node = file == kHostFile ? kHostNodeId : kOmniNodeId;
  opens_[open].client = std::make_shared<FirewireClient>(bus_, node);
}

void FirewireNode::release(FileHandle open) {
  bus_.catch_up();
  const auto found = opens_.find(open);
  if (found == opens_.end()) return;
  const FirewireClient& client = *found->second.client;
  if (client.context()) {
    used_ = true;
    double_starts_ += client.context()->double_starts();
  }
  opens_.erase(found);
  deliver();
}

FuseReply FirewireNode::take(Open& open, std::size_t size) {
  EventQueue& events = open.client->events();
  taken_ = events.pop();
  if (events.empty()) open.announced = false;
  // A buffer that is too small loses the rest of the event.
  return {.bytes = std::span<const std::uint8_t>(taken_).first(std::min(size, taken_.size()))};
}

/// The kernel knows no O_NONBLOCK here: a read without an event sleeps.
std::optional<FuseReply> FirewireNode::read(FileHandle id, FuseRequest request,
                                            std::uint64_t /*offset*/, std::size_t size) {
  bus_.catch_up();
  deliver();
  Open& open = opens_.at(id);
  if (open.client->events().empty()) sleep_on(open);
  if (!open.client->events().empty()) return take(open, size);
  if (open.client->gone()) return FuseReply::fail(ENODEV);
  open.parked.push_back({request, size});
  return std::nullopt;
}

std::optional<FuseReply> FirewireNode::ioctl(FileHandle id, const FuseIoctl& call) {
  bus_.catch_up();
  const FuseReply answer = opens_.at(id).client->ioctl(call);
  deliver();
  return answer;
}

std::uint32_t FirewireNode::poll(FileHandle id, bool sleeps) {
  bus_.catch_up();
  Open& open = opens_.at(id);
  if (sleeps && open.client->events().empty()) sleep_on(open);
  deliver();
  std::uint32_t now = 0;
  if (open.client->gone()) now |= POLLHUP | POLLERR;
  if (open.client->events().empty()) {
    open.announced = false;
  } else {
    now |= POLLIN | POLLRDNORM;
  }
  return now;
}

/// In lock-step a sleep takes the bus to the answer that the client waits for.
void FirewireNode::sleep_on(Open& open) {
  if (!bus_.clock().is_lock_step()) return;
  while (open.client->events().empty() && !open.client->gone() &&
         bus_.next_due() != EventSchedule::kNever) {
    bus_.pass(std::max<std::int64_t>(bus_.next_due() - bus_.cycle(), 1));
  }
}

std::int64_t FirewireNode::next_wake_ns() const noexcept {
  const std::int64_t next = bus_.next_event();
  if (bus_.clock().is_lock_step() || next == EventSchedule::kNever) return EventSchedule::kNever;
  return bus_.clock().begin_ns(next);
}

void FirewireNode::wake() {
  bus_.catch_up();
  deliver();
}

/// Answers reads that wait for an event, and wakes clients that poll for one.
void FirewireNode::deliver() {
  for (auto& entry : opens_) {
    auto& open = entry.second;
    EventQueue& events = open.client->events();
    high_water_ = std::max(high_water_, events.high_water());
    deliver_to(
        entry.first, open, [&] { return !events.empty() || open.client->gone(); },
        [&](std::size_t size) {
          return events.empty() ? FuseReply::fail(ENODEV) : take(open, size);
        });
  }
}

void FirewireNode::bus_was_reset(std::int64_t event_delay) {
  for (auto& [id, open] : opens_) open.client->reclaim_resources();
  if (event_delay == 0) return queue_bus_reset(kOmniNodeId);
  bus_.later(event_delay, [this] { queue_bus_reset(kOmniNodeId); });
}

void FirewireNode::queue_bus_reset(std::uint32_t node) {
  for (auto& [id, open] : opens_) {
    if (open.client->node() == node) open.client->queue_bus_reset();
  }
}

std::int32_t FirewireNode::channel_in_use() const {
  std::int32_t lowest = -1;
  for (const auto& [id, open] : opens_) {
    const std::int32_t channel = open.client->lowest_channel();
    if (channel >= 0 && (lowest < 0 || channel < lowest)) lowest = channel;
  }
  return lowest;
}

void FirewireNode::device_is_gone() {
  for (auto& [id, open] : opens_) {
    if (open.client->node() == kOmniNodeId) open.client->shut_down();
  }
}

}  // namespace kerf
