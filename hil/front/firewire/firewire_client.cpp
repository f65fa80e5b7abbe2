// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/firewire_client.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <ctime>
#include <utility>
#include <vector>

#include <linux/firewire-cdev.h>

#include "hil/front/firewire/bus_registers.hpp"
#include "hil/front/fuse/fuse_channel.hpp"

namespace kerf {
namespace {

constexpr unsigned kLargestNumber = 0x18;  // of an ioctl

constexpr int kMaxRequests = 64;  // transaction labels of a controller

// A transaction on the bus, an allocation (two of them), and the second in which a reset leaves
// resources to the clients that had them.
constexpr std::int64_t kRequestCycles = 2;
constexpr std::int64_t kAllocationCycles = 4;
constexpr std::int64_t kRetryCycles = kBusCyclesPerSecond / 3;
constexpr std::int64_t kGraceCycles = kBusCyclesPerSecond;

constexpr std::size_t kMaxContexts = 4;        // per direction, of a typical controller
constexpr std::uint32_t kFlushesOverflow = 5;  // from this version of the interface on
// Of one QUEUE_ISO: descriptor memory is full before so much is read.
constexpr std::size_t kMaxEntryBytes = 16 << 20;

}  // namespace

FirewireClient::~FirewireClient() {
  if (context_) bus_.detach(*context_);
  for (const auto& [handle, resource] : resources_) {
    if (resource.channel >= 0) {
      bus_.resources().free(resource.channels, resource.channel, resource.bandwidth);
    }
  }
}

FuseReply FirewireClient::ioctl(const FuseIoctl& call) {
  if (gone_) return FuseReply::fail(ENODEV);
  // As the kernel: direction and size of the number are the client's business.
  if (_IOC_TYPE(call.command) != '#' || _IOC_NR(call.command) > kLargestNumber ||
      _IOC_SIZE(call.command) > kLargestArgument) {
    return FuseReply::fail(ENOTTY);
  }
  argument_.fill(0);
  std::copy_n(call.input.begin(), std::min(call.input.size(), argument_.size()), argument_.begin());
  const int result = handle(call);
  if (result < 0) return FuseReply::fail(-result);
  const std::size_t out = std::min(call.output_bytes, argument_.size());
  return {.result = result, .bytes = std::span(argument_).first(out)};
}

int FirewireClient::handle(const FuseIoctl& call) {
  switch (_IOC_NR(call.command)) {
    case _IOC_NR(FW_CDEV_IOC_GET_INFO):
      return get_info(call);
    case _IOC_NR(FW_CDEV_IOC_SEND_REQUEST):
      return send_request(call);
    case _IOC_NR(FW_CDEV_IOC_INITIATE_BUS_RESET):
      bus_.later(1, [&bus = bus_] { bus.reset(BusFault::reset); });
      return 0;
    case _IOC_NR(FW_CDEV_IOC_CREATE_ISO_CONTEXT):
      return create_context();
    case _IOC_NR(FW_CDEV_IOC_QUEUE_ISO):
      return queue(call);
    case _IOC_NR(FW_CDEV_IOC_START_ISO):
      return start();
    case _IOC_NR(FW_CDEV_IOC_STOP_ISO):
      return stop();
    case _IOC_NR(FW_CDEV_IOC_GET_CYCLE_TIMER):
      return get_cycle_timer();
    case _IOC_NR(FW_CDEV_IOC_ALLOCATE_ISO_RESOURCE):
      return allocate();
    case _IOC_NR(FW_CDEV_IOC_DEALLOCATE_ISO_RESOURCE):
      return deallocate();
    case _IOC_NR(FW_CDEV_IOC_GET_SPEED):
      return kDeviceSpeed;
    case _IOC_NR(FW_CDEV_IOC_GET_CYCLE_TIMER2):
      return get_cycle_timer2();
    case _IOC_NR(FW_CDEV_IOC_FLUSH_ISO):
      return flush();
    default:
      return -ENOSYS;
  }
}

fw_cdev_event_bus_reset FirewireClient::bus_reset_event() const noexcept {
  fw_cdev_event_bus_reset event{};
  event.closure = reset_closure_;
  event.type = FW_CDEV_EVENT_BUS_RESET;
  event.node_id = node_;
  event.local_node_id = kHostNodeId;
  event.bm_node_id = event.irm_node_id = event.root_node_id = kHostNodeId;
  event.generation = bus_.generation();
  return event;
}

void FirewireClient::queue_bus_reset() {
  if (linked_ && !gone_) events_.push(bus_reset_event());
}

int FirewireClient::get_info(const FuseIoctl& call) {
  auto info = argument<fw_cdev_get_info>();
  linked_ = true;
  version_ = info.version;
  reset_closure_ = info.bus_reset_closure;
  const std::vector<std::uint32_t> rom =
      node_ == kHostNodeId ? host_config_rom() : bus_.registers().config_rom();
  const auto rom_bytes = static_cast<std::uint32_t>(rom.size() * sizeof rom[0]);
  if (info.rom != 0) {
    const std::span<const std::uint8_t> all(reinterpret_cast<const std::uint8_t*>(rom.data()),
                                            rom_bytes);
    if (!write_caller(call.thread, info.rom, all.first(std::min(info.rom_length, rom_bytes)))) {
      return -EFAULT;
    }
  }
  if (info.bus_reset != 0) {
    const fw_cdev_event_bus_reset event = bus_reset_event();
    if (!write_caller(call.thread, info.bus_reset, fuse_bytes(event))) return -EFAULT;
  }
  info.version = static_cast<std::uint32_t>(bus_.settings().abi_version);
  info.rom_length = rom_bytes;
  info.card = 0;
  give_back(info);
  return 0;
}

// ---- time ----

int FirewireClient::get_cycle_timer2() {
  auto request = argument<fw_cdev_get_cycle_timer2>();
  switch (request.clk_id) {
    case CLOCK_REALTIME:
    case CLOCK_MONOTONIC:
    case CLOCK_MONOTONIC_RAW:
      break;
    default:
      return -EINVAL;
  }
  timespec now{};
  clock_gettime(request.clk_id, &now);
  const BusClock::Instant bus = bus_.clock().at(monotonic_ns());
  request.tv_sec = now.tv_sec;
  request.tv_nsec = static_cast<std::int32_t>(now.tv_nsec);
  request.cycle_timer = cycle_timer(bus.cycle, bus.ticks);
  give_back(request);
  return 0;
}

int FirewireClient::get_cycle_timer() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const BusClock::Instant bus = bus_.clock().at(monotonic_ns());
  fw_cdev_get_cycle_timer timer{};
  timer.local_time = static_cast<std::uint64_t>(now.tv_sec) * 1'000'000 +
                     static_cast<std::uint64_t>(now.tv_nsec) / 1000;
  timer.cycle_timer = cycle_timer(bus.cycle, bus.ticks);
  give_back(timer);
  return 0;
}

// ---- asynchronous requests: an event answers them, cycles later ----

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
    // Data that fits into the padding stands there, and once more behind it.
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
  queue_resource_event(FW_CDEV_EVENT_ISO_RESOURCE_ALLOCATED, handle, settled, settled.channel,
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
      client->queue_resource_event(FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED, handle, resource,
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
      ++it;  // not yet allocated, or taken again: no event
      continue;
    }
    it = resources_.erase(it);
    queue_resource_event(FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED, handle, resource, -EBUSY, 0);
  }
}

void FirewireClient::queue_resource_event(std::uint32_t type, std::uint32_t handle,
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

// ---- the isochronous context ----

int FirewireClient::create_context() {
  auto request = argument<fw_cdev_create_iso_context>();
  const bool transmits = request.type == FW_CDEV_ISO_CONTEXT_TRANSMIT;
  if (request.type == FW_CDEV_ISO_CONTEXT_RECEIVE_MULTICHANNEL) return -ENOSYS;
  if (!transmits && request.type != FW_CDEV_ISO_CONTEXT_RECEIVE) return -EINVAL;
  if (request.channel > 63 || (transmits && request.speed > SCODE_3200)) return -EINVAL;
  if (!transmits && (request.header_size < 4 || request.header_size % 4 != 0)) return -EINVAL;
  if (context_) return -EBUSY;
  std::size_t others = 0;
  for (const IsoContext* other : bus_.contexts()) {
    if (other->settings().transmits != transmits) continue;
    ++others;
    if (!transmits && other->settings().channel == request.channel) return -EBUSY;
  }
  if (others >= kMaxContexts) return -EBUSY;
  context_.emplace(IsoSettings{.transmits = transmits,
                               .channel = request.channel,
                               .header_size = request.header_size,
                               .closure = request.closure,
                               .drops_overflow = version_ < kFlushesOverflow},
                   events_);
  bus_.attach(*context_);
  request.handle = 0;
  give_back(request);
  return 0;
}

int FirewireClient::queue(const FuseIoctl& call) {
  auto request = argument<fw_cdev_queue_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  std::vector<std::uint8_t> entries(std::min<std::size_t>(request.size, kMaxEntryBytes));
  const std::size_t readable = read_caller(call.thread, request.packets, entries);
  const bool all = readable == entries.size();
  entries.resize(readable);
  const IsoContext::Queued queued = context_->queue(entries, all);
  if (queued.error != 0) return -queued.error;
  request.packets += queued.bytes;
  request.size -= static_cast<std::uint32_t>(queued.bytes);
  request.data = 0;
  give_back(request);
  return queued.entries;
}

int FirewireClient::start() {
  const auto request = argument<fw_cdev_start_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  if (!context_->settings().transmits &&
      (request.tags == 0 || request.tags > 15 || request.sync > 15)) {
    return -EINVAL;
  }
  // 2 bits of the second and 13 of the cycle; -1 is the next one.
  std::int64_t first = bus_.cycle() + 1;
  if (request.cycle >= 0) {
    constexpr std::int64_t kPeriod = 4 * kBusCyclesPerSecond;
    const std::int64_t wanted =
        (request.cycle >> 13 & 3) * kBusCyclesPerSecond + (request.cycle & 0x1FFF);
    first += ((wanted - first) % kPeriod + kPeriod) % kPeriod;
  }
  return -context_->start(first, request.tags);
}

int FirewireClient::stop() {
  const auto request = argument<fw_cdev_stop_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  context_->stop();
  return 0;
}

int FirewireClient::flush() {
  const auto request = argument<fw_cdev_flush_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  if (bus_.clock().is_lock_step() && !context_->settings().transmits) {
    bus_.pass(bus_.settings().lockstep_cycles);
  }
  context_->flush();
  return 0;
}

}  // namespace kerf
