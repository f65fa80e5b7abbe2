// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/falcon_plug.hpp"

#include <algorithm>
#include <cerrno>

namespace kerf {
namespace {

constexpr std::uint8_t kToEndpoint = 0x02;    // bmRequestType (USB 2.0, 9.4)
constexpr std::uint8_t kClearFeature = 0x01;  // value 0: ENDPOINT_HALT

}  // namespace

void FalconPlug::catch_up(UsbHost& host) {
  chip_.catch_up([&] { return present_ && halt_ == Halt::none && host.room(); },
                 [&](std::span<const std::uint8_t> packet) {
                   const std::size_t room = *host.room();
                   const auto part = packet.first(std::min(packet.size(), room));
                   host.complete_read(packet.size() <= room ? 0 : -EOVERFLOW, part);
                 });
  script_.run(chip_.time().cycle(), [&](UsbFault fault) { strike(fault, host); });
  if (halt_ == Halt::unreported && present_ && host.room()) {
    halt_ = Halt::reported;
    host.complete_read(-EPIPE, {});
  }
}

std::optional<std::vector<std::uint8_t>> FalconPlug::control(const UsbSetup& setup) {
  if (setup.type == kToEndpoint && setup.request == kClearFeature && !clear_halt(setup.index)) {
    return std::nullopt;
  }
  return chip_.control(setup);
}

bool FalconPlug::clear_halt(unsigned endpoint) noexcept {
  if (endpoint == falcon::kEndpointIn) halt_ = Halt::none;
  return endpoint == falcon::kEndpointIn || endpoint == falcon::kEndpointOut;
}

void FalconPlug::strike(UsbFault fault, UsbHost& host) {
  switch (fault) {
    case UsbFault::stall:
      if (halt_ == Halt::none) halt_ = Halt::unreported;
      return;
    case UsbFault::split:
      return chip_.slow_down(kUsbFaultFrames);
    case UsbFault::deaf:
      deaf_until_ = chip_.time().cycle() + kUsbFaultFrames * kCyclesPerUsbFrame;
      return;
    case UsbFault::vanish:
    case UsbFault::back:
      present_ = fault == UsbFault::back;
      return host.plugged(present_);
  }
}

}  // namespace kerf
