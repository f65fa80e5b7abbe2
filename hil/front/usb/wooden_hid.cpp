// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/wooden_hid.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <unistd.h>

#include "hil/hil_error.hpp"

namespace kerf {
namespace {

/// Writes the first `bytes` of `event`, as many as its kind has; returns false if that fails.
bool tell(int fd, const uhid_event& event, std::size_t bytes = sizeof(uhid_event)) noexcept {
  return write(fd, &event, bytes) >= 0;
}

template <std::size_t N>
void put_text(std::string_view text, __u8 (&out)[N]) {
  std::copy_n(text.begin(), std::min(text.size(), N - 1), out);
}

}  // namespace

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
        if (present_) host.on_report(packet);
      },
      [] {});
  script_.run(time_.cycle(), [&](UsbFault fault) {
    if (fault == UsbFault::nak) {
      nak_until_ = time_.cycle() + kUsbFaultFrames * kCyclesPerUsbFrame;
    }
    if (fault != UsbFault::vanish && fault != UsbFault::back) return;
    present_ = fault == UsbFault::back;
    host.plugged(present_);
  });
}

void WoodenHid::out(std::span<const std::uint8_t> report) noexcept {
  if (report.empty()) return;
  // Without numbered reports a leading 0 is no part of the report; another number is.
  device_.receive(report.front() == wooden::kReportId ? report.subspan(1) : report);
}

int open_uhid() {
  const int fd = open("/dev/uhid", O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (fd >= 0) return fd;
  throw HilError("--front uhid: /dev/uhid: " + std::generic_category().message(errno) +
                 (errno == EACCES ? "; run as root" : "; as root: modprobe uhid"));
}

UhidArm::UhidArm(int fd, const WoodenHid::Settings& settings, PacketDevice& device)
    : arm_(settings, device), fd_(fd) {
  create();
}

UhidArm::~UhidArm() {
  close(fd_);  // which unplugs it
}

void UhidArm::create() {
  uhid_event event{};
  event.type = UHID_CREATE2;
  auto& about = event.u.create2;
  const auto descriptor = arm_.report_descriptor();
  put_text(WoodenHid::name(), about.name);
  put_text(WoodenHid::place(), about.phys);
  put_text(arm_.serial(), about.uniq);
  std::ranges::copy(descriptor, about.rd_data);
  about.rd_size = static_cast<__u16>(descriptor.size());
  about.bus = BUS_USB;
  about.vendor = arm_.vendor_id();
  about.product = arm_.product_id();
  if (!tell(fd_, event)) {
    throw HilError("--front uhid: /dev/uhid: refuses the device (" +
                   std::generic_category().message(errno) + "); as root: modprobe hid-generic");
  }
}

void UhidArm::answer() {
  uhid_event event{};
  if (read(fd_, &event, sizeof event) <= 0) return;
  arm_.catch_up(*this);
  switch (event.type) {
    case UHID_OPEN:
    case UHID_CLOSE:
      open_ = event.type == UHID_OPEN;
      return;
    case UHID_OUTPUT: {
      const std::uint8_t* data = event.u.output.data;
      used_ = true;
      return arm_.out({data, std::min<std::size_t>(event.u.output.size, UHID_DATA_MAX)});
    }
    case UHID_GET_REPORT:
    case UHID_SET_REPORT: {  // the firmware stalls them; both replies begin in the same way
      const bool gets = event.type == UHID_GET_REPORT;
      uhid_event reply{};
      reply.type = gets ? UHID_GET_REPORT_REPLY : UHID_SET_REPORT_REPLY;
      reply.u.set_report_reply.id = gets ? event.u.get_report.id : event.u.set_report.id;
      reply.u.set_report_reply.err = EPIPE;
      tell(fd_, reply);
      return;
    }
    default:
      return;  // started, stopped
  }
}

void UhidArm::on_report(std::span<const std::uint8_t> report) {
  if (!open_) return;
  uhid_event event{};
  event.type = UHID_INPUT2;
  event.u.input2.size = static_cast<__u16>(report.size());
  std::ranges::copy(report, event.u.input2.data);
  const std::size_t bytes =
      offsetof(uhid_event, u) + offsetof(uhid_input2_req, data) + report.size();
  if (!tell(fd_, event, bytes)) ++lost_;
}

void UhidArm::plugged(bool in) {
  if (in) return create();
  uhid_event event{};
  event.type = UHID_DESTROY;
  open_ = false;
  tell(fd_, event, sizeof event.type);
}

}  // namespace kerf
