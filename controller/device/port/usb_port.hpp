// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "controller/device/port/io_mailbox.hpp"
#include "controller/device/port/io_thread.hpp"
#include "controller/device/port/packet_port.hpp"
#include "controller/device/port/turns.hpp"
#include "controller/device/port/usb_falcon.hpp"
#include "shared/wire/falcon_framer.hpp"

struct libusb_transfer;

namespace kerf {

/// What a link over USB has been through.
struct UsbLinkStats {
  std::uint64_t packets = 0;   ///< of the device, handed to the servo
  std::uint64_t overflow = 0;  ///< ... that the servo did not take in time
  std::uint64_t strays = 0;    ///< bytes of the device that belonged to no packet
  std::uint64_t commands = 0;  ///< packets that the device has taken
  std::uint64_t failures = 0;  ///< transfers that ended in a stall or another error
};

/// The Novint Falcon over libusb.
///
/// libusb allocates in every submit and sleeps in system calls, so a thread of its own does the
/// input and output, with transfers that were allocated before and have no time-out. The servo
/// touches only the mailbox: `receive` and `send` neither call the system, nor lock, nor allocate.
///
/// Host and device take turns. Each answer sends the newest command that waits, so it does not
/// matter where in the device's frame the servo ticks. Where none waits the thread looks for one
/// every 50 us, because nobody wakes it; otherwise whenever a transfer ends, which the chip's
/// latency timer makes happen once a millisecond. A command that the device does not take in its
/// turn is taken back for a newer one; `send_now` goes out of turn.
///
/// On the way out the destructor sends what waits, for 20 ms at most. `send_last`, for the handler
/// of a crash, waits until it is sent; only where the I/O thread itself has crashed, or on SIGKILL,
/// the last packet stays behind.
class UsbPort final : public PacketPort {
 public:
  /// Finds the device, claims it, starts its firmware. Tries for `patience_ms` while none is there,
  /// or until `stop`. Throws std::runtime_error with one line.
  UsbPort(const UsbOptions& options, int patience_ms, const std::atomic<bool>& stop,
          IoThread io = {});
  ~UsbPort() override;
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    return inbox_.take(out);
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    return !closed() && outbox_.put(packet);
  }
  bool send_now(std::span<const std::uint8_t> packet) noexcept override;
  bool send_last(std::span<const std::uint8_t> packet) noexcept override;
  [[nodiscard]] bool closed() const noexcept override {
    return closed_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool wait(int milliseconds) noexcept override {
    return inbox_.wait(milliseconds, closed_);
  }

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
  Inbox inbox_;
  Outbox outbox_;
  std::atomic<bool> closed_{false}, stop_{false};
  std::atomic<bool> hurry_{false};  ///< what waits does so for no turn
  std::atomic<int> thread_id_{0};
  std::atomic<std::uint64_t> packets_{0}, overflow_{0}, strays_{0}, commands_{0}, failures_{0};

  // I/O thread only.
  std::array<Transfer, kReads> reads_{};
  Transfer write_;
  bool read_halted_ = false, write_halted_ = false;  ///< endpoints: freed outside of the callback
  falcon::Framer framer_;
  Turns turns_;
  std::int64_t reply_due_ns_ = 0;  ///< until then the servo's answer to a packet is looked for
  int failures_in_a_row_ = 0;
  IoThread io_;
  std::thread thread_;
};

}  // namespace kerf
