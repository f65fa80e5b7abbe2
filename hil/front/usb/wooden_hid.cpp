// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/wooden_hid.hpp"

namespace kerf {

std::uint16_t WoodenHid::vendor_id() const noexcept {
  return packet_bytes_ == wooden::kPacketBytes ? wooden::kMbedVendorId : wooden::kTeensyVendorId;
}
std::uint16_t WoodenHid::product_id() const noexcept {
  return packet_bytes_ == wooden::kPacketBytes ? wooden::kMbedProductId : wooden::kTeensyProductId;
}

std::vector<std::uint8_t> WoodenHid::report_descriptor() const {
  const auto bytes =
      usb_bytes(0x06, low(wooden::kUsagePage), high(wooden::kUsagePage),  // usage page
                0x0A, low(wooden::kUsage), high(wooden::kUsage),          // usage
                0xA1, 0x01,                                               // collection: application
                0x75, 0x08, 0x15, 0x00, 0x26, 0xFF, 0x00,                 // bytes of 0 to 255
                0x95, packet_bytes_, 0x09, 0x01, 0x81, 0x02,              // so many in
                0x95, packet_bytes_, 0x09, 0x02, 0x91, 0x02,              // and out
                0xC0);
  return {bytes.begin(), bytes.end()};
}

void WoodenHid::catch_up(HidHost& host) {
  time_.catch_up(
      device_,
      [&](std::span<const std::uint8_t> packet) {
        ++reports_;
        if (present_) host.hear(packet);
      },
      [] {});
  script_.run(time_.cycle(), [&](UsbFault fault) {
    if (fault == UsbFault::deaf) {
      deaf_until_ = time_.cycle() + kUsbFaultFrames * kCyclesPerUsbFrame;
    }
    if (fault != UsbFault::vanish && fault != UsbFault::back) return;
    present_ = fault == UsbFault::back;
    host.plugged(present_);
  });
}

void WoodenHid::out(std::span<const std::uint8_t> report) noexcept {
  if (report.empty()) return;
  // Without numbered reports a leading 0 is no part of what is sent; another number is.
  device_.receive(report.front() == wooden::kReportId ? report.subspan(1) : report);
}

}  // namespace kerf
