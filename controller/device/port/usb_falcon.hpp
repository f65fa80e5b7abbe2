// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "controller/device/port/falcon_boot.hpp"
#include "shared/wire/falcon_usb.hpp"

struct libusb_context;
struct libusb_device_handle;

namespace kerf {

/// What `--port usb[:WHERE][,firmware=FILE]` says.
struct UsbOptions {
  std::string where;     ///< a node (/dev/bus/usb/001/002) or a serial number; empty: any one
  std::string firmware;  ///< the Falcon's, which this project does not have
};

/// Throws std::runtime_error with one line when `text`, what follows "usb", cannot be read.
[[nodiscard]] UsbOptions parse_usb_port(std::string_view text);

/// An open Falcon: libusb's context, its handle, the claimed interface; and its serial line as long
/// as nobody has transfers of his own on it. One thread.
class UsbFalcon final : public FalconLine {
 public:
  /// Throws std::runtime_error with one line when it cannot be opened; nothing when none is there.
  [[nodiscard]] static std::unique_ptr<UsbFalcon> open(const std::string& where);
  ~UsbFalcon() override;
  UsbFalcon(const UsbFalcon&) = delete;
  UsbFalcon& operator=(const UsbFalcon&) = delete;

  void control(falcon::FtdiRequest request, std::uint16_t value) override;
  void write(std::span<const std::uint8_t> bytes) override;
  std::size_t read(std::span<std::uint8_t> out, int milliseconds) override;

  [[nodiscard]] libusb_context* context() const noexcept { return context_; }
  [[nodiscard]] libusb_device_handle* handle() const noexcept { return handle_; }

 private:
  UsbFalcon();
  [[nodiscard]] bool open_node(const std::string& path);
  [[nodiscard]] bool open_found(const std::string& serial);
  void claim(const std::string& where);

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  int fd_ = -1;  ///< of a node that was named
};

/// The line that tells the user why there is no device; `where` as he gave it.
[[noreturn]] void refuse_usb(const std::string& where, const std::string& rest);

}  // namespace kerf
