// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "controller/device/port/falcon_boot.hpp"
#include "controller/device/port/io_mailbox.hpp"
#include "shared/wire/falcon.hpp"

// The Falcon over libusb: finds and opens it, starts its firmware, and moves packets on a thread of
// its own.

struct libusb_context;
struct libusb_device_handle;
struct libusb_transfer;

namespace kerf {

/// Options of `--port usb[:WHERE][,firmware=FILE]`.
struct UsbOptions {
  std::string where;     ///< a node (/dev/bus/usb/001/002) or a serial number; if empty, any one
  std::string firmware;  ///< of the Falcon, which is not part of this project
};

/// Reads `text`, the part after "usb". Throws std::runtime_error with one line.
[[nodiscard]] UsbOptions parse_usb_port(std::string_view text);

/// An open Falcon: libusb's context, its handle, the claimed interface; and its serial line until
/// a port has transfers of its own on it. One thread.
class UsbFalcon final : public FalconLine {
 public:
  /// Null if no device is connected. Throws std::runtime_error with one line if it cannot be
  /// opened.
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
  int fd_ = -1;  ///< of a named node
};

/// Counters of a link over USB.
struct UsbLinkStats {
  std::uint64_t packets = 0;   ///< of the device, passed to the servo
  std::uint64_t overflow = 0;  ///< ... that the servo did not take in time
  std::uint64_t strays = 0;    ///< bytes of the device outside of any packet
  std::uint64_t commands = 0;  ///< packets that the device has taken
  std::uint64_t failures = 0;  ///< transfers that ended in a stall or another error
};

/// The Novint Falcon over libusb.
///
/// libusb allocates in every submit and sleeps in system calls, so a thread of its own does the
/// input and output, with transfers that were allocated before and have no time-out. The servo
/// touches only the mailbox: `receive` and `send` neither call the system, nor lock, nor allocate.
///
/// Host and device take turns. Each answer sends the newest waiting command, so the phase of the
/// servo in the device's frame does not matter. If none waits the thread checks for one every 50
/// us, because nothing wakes it; otherwise whenever a transfer ends, which the latency timer of the
/// chip causes once a millisecond. A command that the device does not take in its turn is replaced
/// by a newer one; `send_now` goes out of turn.
///
/// The destructor sends the waiting packets, for 20 ms at most. `send_last`, for the handler of a
/// crash, waits until its packet is sent; that fails only if the I/O thread itself has crashed, or
/// on SIGKILL.
class UsbPort final : public MailboxPort {
 public:
  /// Finds the device, claims it, starts its firmware. Retries for `patience_ms` while none is
  /// connected, or until `stop`. Throws std::runtime_error with one line.
  UsbPort(const UsbOptions& options, int patience_ms, const std::atomic<bool>& stop,
          IoThread io = {});
  ~UsbPort() override;
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  bool send(std::span<const std::uint8_t> packet) noexcept override {
    return !gone_.load(std::memory_order_relaxed) && outbox_.put(packet);
  }
  bool send_now(std::span<const std::uint8_t> packet) noexcept override;

  [[nodiscard]] std::vector<LinkCounter> counters() const override;

  /// Any thread.
  [[nodiscard]] UsbLinkStats stats() const noexcept;

 private:
  static constexpr std::size_t kReads = 4;
  struct Transfer {
    UsbPort* port = nullptr;
    libusb_transfer* usb = nullptr;
    bool busy = false;
    std::array<std::uint8_t, falcon::kFtdiPacketBytes> bytes{};
  };

  void prepare(Transfer& transfer, std::uint8_t endpoint);
  void run() noexcept;
  void send_rest() noexcept;
  void submit(Transfer& transfer) noexcept;
  void failed(const Transfer& transfer) noexcept;
  void send_waiting() noexcept;
  void finished(Transfer& transfer) noexcept;
  void hear(std::span<const std::uint8_t> bytes) noexcept;
  void repair() noexcept;
  void handle_events(std::int64_t ns) noexcept;

  std::unique_ptr<UsbFalcon> device_;
  std::atomic<bool> gone_{false};   ///< no command leaves: unplugged
  std::atomic<bool> hurry_{false};  ///< send the waiting command out of turn
  std::atomic<std::uint64_t> packets_{0}, overflow_{0}, strays_{0}, commands_{0}, failures_{0};

  // I/O thread only.
  std::array<Transfer, kReads> reads_{};
  Transfer write_;
  bool read_halted_ = false,
       write_halted_ = false;  ///< stalled endpoints, cleared outside of the callback
  falcon::Framer framer_;
  Turns turns_;
  std::int64_t reply_due_ns_ = 0;  ///< end of the checks for the servo's answer to a packet
  int failures_in_a_row_ = 0;
  IoThread io_;
  int firmware_tries_ = 0;
  std::thread thread_;
};

}  // namespace kerf
