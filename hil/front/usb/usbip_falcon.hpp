// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hil/front/serving.hpp"
#include "hil/front/usb/falcon_usb.hpp"

/// An emulated Falcon behind the kernel's USB/IP. The messages of a connection after its set-up
/// (Documentation/usb/usbip_protocol.rst of the kernel) have 48 bytes of big-endian words, then the
/// bytes of the transfer in one direction.
namespace kerf::usbip {

inline constexpr std::size_t kHeaderBytes = 48;
using Header = std::array<std::uint8_t, kHeaderBytes>;

/// First word of a message: two that the host sends, and their answers.
enum class UsbipCommand : std::uint32_t { submit = 1, unlink = 2, submitted = 3, unlinked = 4 };

/// A request of the host.
struct Request {
  UsbipCommand command{};
  std::uint32_t sequence = 0;
  bool to_host = false;
  std::uint32_t endpoint = 0;  ///< its number, without the direction
  std::uint32_t bytes = 0;     ///< of the transfer; of a submit
  std::uint32_t unlinks = 0;   ///< sequence of the transfer to give up; of an unlink
  std::array<std::uint8_t, 8> setup{};
};

}  // namespace kerf::usbip

namespace kerf {

/// An emulated Falcon on USB/IP: behind `vhci_hcd` the kernel's own USB stack takes it for
/// a device at one of its ports.
///
/// A read completes when the device has a packet, at most once per 1 ms frame; a write and a
/// control request at once. A host that breaks the protocol is unplugged.
class UsbipFalcon final : public KernelDevice, private UsbHost {
 public:
  /// Plugs the device in: one end of a stream socket whose other end the host has. Owned here.
  using PlugIn = std::function<int()>;
  UsbipFalcon(const FtdiFalcon::Settings& settings, std::vector<ScriptedUsbFault> script,
              PacketDevice& device, PlugIn plug_in)
      : falcon_(settings, std::move(script), device),
        plug_in_(std::move(plug_in)),
        fd_(plug_in_()) {}
  UsbipFalcon(const UsbipFalcon&) = delete;
  UsbipFalcon& operator=(const UsbipFalcon&) = delete;
  ~UsbipFalcon() override { unplug(); }

  [[nodiscard]] int descriptor() const noexcept override { return fd_; }
  void answer() override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override {
    return chip().time().next_frame_ns();
  }
  void wake() override { falcon_.catch_up(*this); }

  /// The host has closed the connection: the device cannot be plugged in again.
  [[nodiscard]] bool left() const noexcept { return left_; }
  [[nodiscard]] const FtdiFalcon& chip() const noexcept { return falcon_.chip(); }

 private:
  struct Read {
    std::uint32_t sequence = 0;
    std::size_t room = 0;
  };

  [[nodiscard]] std::optional<std::size_t> room() override;
  void complete_read(int status, std::span<const std::uint8_t> bytes) override;
  void plugged(bool in) override;

  [[nodiscard]] bool take_message();
  void serve(const usbip::Request& request, std::span<const std::uint8_t> bytes);
  void submit_control(const usbip::Request& request);
  void unlink(const usbip::Request& request);
  void say(const usbip::Header& header, std::span<const std::uint8_t> bytes = {});
  void lose_host() noexcept;
  void unplug() noexcept;

  FalconUsb falcon_;
  PlugIn plug_in_;
  int fd_;
  bool left_ = false;
  std::vector<std::uint8_t> received_;  ///< whole messages and the first part of one
  std::deque<Read> reads_;
};

/// Plugs a full-speed device into a free port of the kernel's virtual USB host controller (module
/// vhci-hcd) and returns the device's end of the cable, a stream socket on USB/IP. The
/// caller closes it, which unplugs the device. Throws `HilError` if the module, the right (root) or
/// a free port is missing.
[[nodiscard]] int plug_into_vhci();

}  // namespace kerf
