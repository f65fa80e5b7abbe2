// SPDX-License-Identifier: Apache-2.0
// The asynchronous side of an open: requests to the device, channels and bandwidth. What is asked
// for is answered by an event, cycles later.
#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <utility>
#include <vector>

#include <linux/firewire-cdev.h>

#include "hil/front/firewire/firewire_client.hpp"
#include "hil/front/firewire/host_registers.hpp"
#include "hil/front/fuse/caller_memory.hpp"

namespace kerf {
namespace {

constexpr int kMaxRequests = 64;  // transaction labels of a controller

// A transaction on the bus, an allocation (two of them), and the second in which a reset leaves
// resources to those who had them.
constexpr std::int64_t kRequestCycles = 2;
constexpr std::int64_t kAllocationCycles = 4;
constexpr std::int64_t kRetryCycles = kBusCyclesPerSecond / 3;
constexpr std::int64_t kGraceCycles = kBusCyclesPerSecond;

}  // namespace

// ---- asynchronous requests ----

int FirewireClient::send_request(const FuseIoctl& call) {
  const auto request = argument<fw_cdev_send_request>();
  switch (request.tcode) {
    case TCODE_WRITE_QUADLET_REQUEST:
    case TCODE_WRITE_BLOCK_REQUEST:
    case TCODE_READ_QUADLET_REQUEST:
    case TCODE_READ_BLOCK_REQUEST:
    case TCODE_LOCK_MASK_SWAP:
    case TCODE_LOCK_COMPARE_SWAP:
    case TCODE_LOCK_FETCH_ADD:
    case TCODE_LOCK_LITTLE_ADD:
    case TCODE_LOCK_BOUNDED_ADD:
    case TCODE_LOCK_WRAP_ADD:
    case TCODE_LOCK_VENDOR_DEPENDENT:
      break;
    default:
      return -EINVAL;
  }
  if (request.length > 512U << kDeviceSpeed) return -EIO;
  if (request.tcode == TCODE_WRITE_QUADLET_REQUEST && request.length < 4) return -EINVAL;
  std::vector<std::uint8_t> data(request.length);
  if (request.data != 0 && read_caller(call.thread, request.data, data) != data.size()) {
    return -EFAULT;
  }
  // From here on every failure is an answer of the bus, never of the ioctl.
  if (requests_on_the_way_ >= kMaxRequests) {
    respond(request.closure, RCODE_SEND_ERROR);
    return 0;
  }
  ++requests_on_the_way_;
  bus_.later(kRequestCycles, [weak = weak_from_this(), request, data = std::move(data)]() mutable {
    const auto client = weak.lock();
    if (!client) return;
    --client->requests_on_the_way_;
    client->execute(request.tcode, request.offset, request.generation, request.closure,
                    std::move(data));
  });
  return 0;
}

void FirewireClient::execute(std::uint32_t tcode, std::uint64_t offset, std::uint32_t generation,
                             std::uint64_t closure, std::vector<std::uint8_t> data) {
  if (generation != bus_.generation()) return respond(closure, RCODE_GENERATION);
  if (node_ == kOmniNodeId) return ask_device(tcode, offset, closure, std::move(data));
  const BusClock::Instant now = bus_.clock().at(monotonic_ns());
  std::vector<std::uint8_t> answer;
  const std::uint32_t rcode =
      ask_host(tcode, offset, data, cycle_timer(now.cycle, now.ticks), bus_.resources(), answer);
  respond(closure, rcode, answer);
}

void FirewireClient::ask_device(std::uint32_t tcode, std::uint64_t offset, std::uint64_t closure,
                                std::vector<std::uint8_t> data) {
  if (!bus_.present()) return respond(closure, RCODE_NO_ACK);
  OmniRegisters& registers = bus_.registers();
  switch (tcode) {
    case TCODE_WRITE_QUADLET_REQUEST:
      data.resize(4);
      [[fallthrough]];
    case TCODE_WRITE_BLOCK_REQUEST:
      return respond(closure, registers.write(offset, data));
    case TCODE_READ_QUADLET_REQUEST:
      data.resize(4);
      [[fallthrough]];
    case TCODE_READ_BLOCK_REQUEST: {
      const std::uint32_t rcode = registers.read(offset, data);
      return rcode == RCODE_COMPLETE ? respond(closure, rcode, data) : respond(closure, rcode);
    }
    default:
      return respond(closure, RCODE_TYPE_ERROR);  // the device knows no lock requests
  }
}

void FirewireClient::respond(std::uint64_t closure, std::uint32_t rcode,
                             std::span<const std::uint8_t> data) {
  fw_cdev_event_response event{};
  event.closure = closure;
  event.type = FW_CDEV_EVENT_RESPONSE;
  event.rcode = rcode;
  event.length = static_cast<std::uint32_t>(data.size());
  constexpr std::size_t kDataAt = offsetof(fw_cdev_event_response, data);
  if (data.size() <= sizeof event - kDataAt) {
    // What fits into the padding stands there, and once more behind it.
    auto* bytes = reinterpret_cast<std::uint8_t*>(&event);
    std::copy(data.begin(), data.end(), bytes + kDataAt);
    events_.push(event, data);
  } else {
    events_.push(event, data, kDataAt);
  }
}

// ---- channels and bandwidth ----

int FirewireClient::allocate() {
  auto request = argument<fw_cdev_allocate_iso_resource>();
  if ((request.channels == 0 && request.bandwidth == 0) ||
      request.bandwidth > static_cast<std::uint32_t>(IsoResources::kBandwidth)) {
    return -EINVAL;
  }
  request.handle = next_handle_++;
  resources_[request.handle] = {request.channels, -1, static_cast<std::int32_t>(request.bandwidth),
                                request.closure};
  bus_.later(kAllocationCycles, [weak = weak_from_this(), handle = request.handle] {
    if (const auto client = weak.lock()) client->try_allocation(handle);
  });
  give_back(request);
  return 0;
}

void FirewireClient::try_allocation(std::uint32_t handle) {
  const auto found = resources_.find(handle);
  if (found == resources_.end()) return;  // given back meanwhile
  if (bus_.cycle() - bus_.reset_cycle() < kGraceCycles) {
    bus_.later(kRetryCycles, [weak = weak_from_this(), handle] {
      if (const auto client = weak.lock()) client->try_allocation(handle);
    });
    return;
  }
  Resource& resource = found->second;
  resource.channel = bus_.resources().allocate(resource.channels, resource.bandwidth);
  const Resource settled = resource;
  if (settled.channel < 0) resources_.erase(found);
  tell_resource(FW_CDEV_EVENT_ISO_RESOURCE_ALLOCATED, handle, settled, settled.channel,
                settled.channel < 0 ? 0 : settled.bandwidth);
}

int FirewireClient::deallocate() {
  const auto request = argument<fw_cdev_deallocate>();
  const auto found = resources_.find(request.handle);
  if (found == resources_.end()) return -EINVAL;
  const Resource resource = found->second;
  resources_.erase(found);
  if (resource.channel >= 0) {
    bus_.resources().free(resource.channels, resource.channel, resource.bandwidth);
  }
  bus_.later(kAllocationCycles, [weak = weak_from_this(), handle = request.handle, resource] {
    if (const auto client = weak.lock()) {
      client->tell_resource(FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED, handle, resource,
                            resource.channel, resource.bandwidth);
    }
  });
  return 0;
}

void FirewireClient::reclaim_resources() {
  for (auto it = resources_.begin(); it != resources_.end();) {
    const auto [handle, resource] = *it;
    const std::uint64_t own =
        resource.channels == 0 ? 0 : std::uint64_t{1} << std::max(resource.channel, 0);
    if (resource.channel < 0 || bus_.resources().allocate(own, resource.bandwidth) >= 0) {
      ++it;  // not yet allocated, or taken again: nobody is told
      continue;
    }
    it = resources_.erase(it);
    tell_resource(FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED, handle, resource, -EBUSY, 0);
  }
}

void FirewireClient::tell_resource(std::uint32_t type, std::uint32_t handle,
                                   const Resource& resource, std::int32_t channel,
                                   std::int32_t bandwidth) {
  fw_cdev_event_iso_resource event{};
  event.closure = resource.closure;
  event.type = type;
  event.handle = handle;
  event.channel = channel;
  event.bandwidth = bandwidth;
  events_.push(event);
}

std::int32_t FirewireClient::lowest_channel() const noexcept {
  std::int32_t lowest = -1;
  for (const auto& [handle, resource] : resources_) {
    if (resource.channel >= 0 && (lowest < 0 || resource.channel < lowest)) {
      lowest = resource.channel;
    }
  }
  return lowest;
}

}  // namespace kerf
