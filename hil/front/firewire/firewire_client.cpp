// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/firewire_client.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>

#include "hil/front/firewire/host_registers.hpp"
#include "hil/front/fuse/caller_memory.hpp"
#include "hil/front/fuse/fuse_channel.hpp"

namespace kerf {
namespace {

constexpr unsigned kLargestNumber = 0x18;

}  // namespace

FirewireClient::~FirewireClient() {
  if (context_) bus_.detach(*context_);
  for (const auto& [handle, resource] : resources_) {
    if (resource.channel >= 0) {
      bus_.resources().free(resource.channels, resource.channel, resource.bandwidth);
    }
  }
}

FuseAnswer FirewireClient::ioctl(const FuseIoctl& call) {
  if (gone_) return FuseAnswer::fail(ENODEV);
  // As the kernel: direction and size of the number are the client's business.
  if (_IOC_TYPE(call.command) != '#' || _IOC_NR(call.command) > kLargestNumber ||
      _IOC_SIZE(call.command) > kLargestArgument) {
    return FuseAnswer::fail(ENOTTY);
  }
  argument_.fill(0);
  std::copy_n(call.input.begin(), std::min(call.input.size(), argument_.size()), argument_.begin());
  const int result = handle(call);
  if (result < 0) return FuseAnswer::fail(-result);
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

void FirewireClient::tell_bus_reset() {
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

}  // namespace kerf
