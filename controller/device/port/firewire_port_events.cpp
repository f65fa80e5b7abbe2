// SPDX-License-Identifier: Apache-2.0
// What the kernel tells a FirewirePort: received packets, bus resets, answers, resources.
#include <linux/firewire-cdev.h>

#include "controller/device/port/firewire_port.hpp"
#include "controller/device/port/firewire_requests.hpp"

namespace kerf {

void FirewirePort::read_requests() noexcept {
  while (requests_.ready(0)) {
    const auto event = requests_.event();
    if (event.empty()) return;
    hear(event);
  }
}

void FirewirePort::read_transmitted() noexcept {
  transmitter_.drained();
  while (transmitted_.ready(0)) {
    const auto event = transmitted_.read(sent_event_);
    if (event.empty()) return;
    if (event_as<fw_cdev_event_common>(event).type == FW_CDEV_EVENT_ISO_INTERRUPT) {
      transmitter_.take(event);
    } else {
      hear(event);
    }
  }
}

void FirewirePort::hear(std::span<const std::uint8_t> event) noexcept {
  if (event.size() < sizeof(std::uint64_t) + sizeof(std::uint32_t)) return;
  switch (event_as<fw_cdev_event_common>(event).type) {
    case FW_CDEV_EVENT_ISO_INTERRUPT:
      return receiver_.take(event);
    case FW_CDEV_EVENT_BUS_RESET:
      return hear_reset(event_as<fw_cdev_event_bus_reset>(event).generation);
    case FW_CDEV_EVENT_RESPONSE:
      return hear_response(event);
    case FW_CDEV_EVENT_ISO_RESOURCE_ALLOCATED:
      return hear_resource(event, true);
    case FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED:
      return hear_resource(event, false);
    default:
      return;
  }
}

/// Each open tells of the same reset; the first one counts.
void FirewirePort::hear_reset(std::uint32_t generation) noexcept {
  if (generation == requests_.generation()) return;
  ++stats_.resets;
  requests_.set_generation(generation);
  if (state_ == State::streaming || state_ == State::arming) arm();
}

void FirewirePort::hear_response(std::span<const std::uint8_t> event) noexcept {
  const auto response = event_as<fw_cdev_event_response>(event);
  if (state_ != State::arming || response.closure != batch_) return;
  if (response.rcode == RCODE_COMPLETE) ++answers_;
  // Any other answer is tried again later: a device may be busy, or away for a moment.
  if (response.rcode == RCODE_GENERATION && requests_.refresh()) stale_ = true;
}

void FirewirePort::hear_resource(std::span<const std::uint8_t> event, bool allocated) noexcept {
  const auto resource = event_as<fw_cdev_event_iso_resource>(event);
  FirewireClaim& claim = resource.closure == kListen ? listen_ : talk_;
  if (claim.handle != resource.handle) {  // of an earlier claim, which nobody waits for any more
    if (allocated && resource.channel >= 0) requests_.give_back({resource.handle, -1});
    return;
  }
  if (allocated) {
    claim.channel = resource.channel;
    refused_ = refused_ || resource.channel < 0;
    return;
  }
  if (resource.channel >= 0) return;  // we gave it back ourselves
  claim.channel = -1;
  ++stats_.reclaims;
  muted_ = true;
  state_ = State::yielding;
  turns_ = 0;
}

}  // namespace kerf
