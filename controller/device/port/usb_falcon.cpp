// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/usb_falcon.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <libusb-1.0/libusb.h>
#include <unistd.h>

#include "shared/posix/failure.hpp"

namespace kerf {
namespace {

constexpr int kInterface = 0;
constexpr unsigned kTransferMs = 1000;
constexpr const char* kGiveRight =
    "; give your user the right: a udev rule with ATTRS{idVendor}==\"0403\", "
    "ATTRS{idProduct}==\"cb48\", TAG+=\"uaccess\" (docs/devices.md)";

[[noreturn]] void fail(const char* what, int error) {
  throw std::runtime_error(std::string(what) + ": " + libusb_strerror(error) +
                           "; unplug the device, plug it in again");
}

bool is_falcon(libusb_device* device) noexcept {
  libusb_device_descriptor about{};
  return libusb_get_device_descriptor(device, &about) == 0 && about.idVendor == falcon::kVendorId &&
         about.idProduct == falcon::kProductId;
}

std::string node_of(libusb_device* device) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "/dev/bus/usb/%03u/%03u", libusb_get_bus_number(device),
                libusb_get_device_address(device));
  return text.data();
}

std::string serial_of(libusb_device_handle* handle) {
  libusb_device_descriptor about{};
  std::array<unsigned char, 128> text{};
  if (libusb_get_device_descriptor(libusb_get_device(handle), &about) != 0) return {};
  const int size = libusb_get_string_descriptor_ascii(handle, about.iSerialNumber, text.data(),
                                                      static_cast<int>(text.size()));
  return {text.begin(), text.begin() + std::max(size, 0)};
}

/// One device that was found, open where that is allowed.
struct Found {
  std::string node, serial;
  libusb_device_handle* handle = nullptr;
  int error = 0;
};

std::vector<Found> list_falcons(libusb_context* context) {
  std::vector<Found> all;
  libusb_device** devices = nullptr;
  const ssize_t count = libusb_get_device_list(context, &devices);
  for (ssize_t i = 0; i < count; ++i) {
    if (!is_falcon(devices[i])) continue;
    Found& found = all.emplace_back();
    found.node = node_of(devices[i]);
    found.error = libusb_open(devices[i], &found.handle);
    if (found.error == 0) found.serial = serial_of(found.handle);
  }
  if (devices) libusb_free_device_list(devices, 1);
  std::ranges::sort(all, {}, &Found::node);
  return all;
}

}  // namespace

void refuse_usb(const std::string& where, const std::string& rest) {
  throw std::runtime_error("--port usb" + (where.empty() ? "" : ":" + where) + ": " + rest);
}

UsbOptions parse_usb_port(std::string_view text) {
  UsbOptions options;
  if (!text.empty() && text.front() == ':') text.remove_prefix(1);
  options.where = text.substr(0, text.find(','));
  text.remove_prefix(options.where.size());
  if (text.empty()) return options;
  constexpr std::string_view kFirmware = ",firmware=";
  if (!text.starts_with(kFirmware) || text.size() == kFirmware.size()) {
    refuse_usb("", "'" + std::string(text.substr(1)) + "' is not known; use firmware=FILE");
  }
  options.firmware = text.substr(kFirmware.size());
  return options;
}

UsbFalcon::UsbFalcon() {
  if (const int error = libusb_init(&context_); error != 0) fail("libusb", error);
}

UsbFalcon::~UsbFalcon() {
  if (handle_) {
    libusb_release_interface(handle_, kInterface);
    libusb_close(handle_);
  }
  if (fd_ >= 0) close(fd_);
  libusb_exit(context_);
}

std::unique_ptr<UsbFalcon> UsbFalcon::open(const std::string& where) {
  std::unique_ptr<UsbFalcon> device(new UsbFalcon);
  const bool is_path = where.find('/') != std::string::npos;
  if (!(is_path ? device->open_node(where) : device->open_found(where))) return nullptr;
  device->claim(where);
  return device;
}

bool UsbFalcon::open_node(const std::string& path) {
  fd_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd_ < 0 && errno == ENOENT) return false;
  if (fd_ < 0) {
    refuse_usb(path, "cannot be opened (" + std::generic_category().message(errno) + ")" +
                         (errno == EACCES ? kGiveRight
                                          : std::string("; ") +
                                                way_out_of(errno, "name the node of a Falcon")));
  }
  const int error = libusb_wrap_sys_device(context_, static_cast<std::intptr_t>(fd_), &handle_);
  if (error != 0) {
    refuse_usb(path, std::string("is no USB device (") + libusb_strerror(error) +
                         "); name a node below /dev/bus/usb");
  }
  if (!is_falcon(libusb_get_device(handle_))) {
    refuse_usb(path, "is another device than a Falcon (0403:cb48); see lsusb");
  }
  return true;
}

bool UsbFalcon::open_found(const std::string& serial) {
  std::vector<Found> all = list_falcons(context_);
  if (!serial.empty()) {
    const auto is_other = [&](const Found& f) { return f.error == 0 && f.serial != serial; };
    for (const Found& found : all) {
      if (is_other(found)) libusb_close(found.handle);
    }
    std::erase_if(all, is_other);
  }
  if (all.empty()) return false;
  const Found first = all.front();
  if (all.size() == 1 && first.error == 0) {
    handle_ = first.handle;
    return true;
  }
  std::string list;
  for (const Found& found : all) {
    if (found.handle) libusb_close(found.handle);
    list += " " + found.node + (found.serial.empty() ? "" : " (" + found.serial + ")");
  }
  if (all.size() > 1) {
    refuse_usb(serial, "several Falcons are there:" + list + "; name one by its node or serial");
  }
  refuse_usb(serial,
             first.node + " cannot be opened (" + libusb_strerror(first.error) + ")" + kGiveRight);
}

void UsbFalcon::claim(const std::string& where) {
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  const int error = libusb_claim_interface(handle_, kInterface);
  if (error == 0) return;
  refuse_usb(where, std::string("cannot be claimed (") + libusb_strerror(error) +
                        "); end the program that uses it");
}

void UsbFalcon::control(falcon::FtdiRequest request, std::uint16_t value) {
  const int error =
      libusb_control_transfer(handle_, falcon::kFtdiRequestType, static_cast<std::uint8_t>(request),
                              value, 0, nullptr, 0, kTransferMs);
  if (error < 0) fail("a setting was refused", error);
}

void UsbFalcon::write(std::span<const std::uint8_t> bytes) {
  int sent = 0;
  // libusb's buffer is not const, because the same call reads.
  const int error =
      libusb_bulk_transfer(handle_, falcon::kEndpointOut, const_cast<std::uint8_t*>(bytes.data()),
                           static_cast<int>(bytes.size()), &sent, kTransferMs);
  if (error < 0) fail("bytes were not taken", error);
}

std::size_t UsbFalcon::read(std::span<std::uint8_t> out, int milliseconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(milliseconds);
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> packet{};
  do {
    int size = 0;
    const int error = libusb_bulk_transfer(handle_, falcon::kEndpointIn, packet.data(),
                                           static_cast<int>(packet.size()), &size,
                                           static_cast<unsigned>(std::max(milliseconds, 1)));
    if (error < 0 && error != LIBUSB_ERROR_TIMEOUT) fail("bytes did not come", error);
    const auto payload = std::span(packet).first(static_cast<std::size_t>(size));
    if (payload.size() <= falcon::kFtdiStatusBytes) continue;  // status alone
    const auto bytes = payload.subspan(falcon::kFtdiStatusBytes);
    std::copy_n(bytes.begin(), std::min(bytes.size(), out.size()), out.begin());
    return std::min(bytes.size(), out.size());
  } while (std::chrono::steady_clock::now() < deadline);
  return 0;
}

}  // namespace kerf
