// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <semaphore.h>

#include "controller/device/port/io_mailbox.hpp"

struct hid_device_;

namespace kerf {

/// The WoodenHaptics arm over hidapi's hidraw back end: reports of 14 bytes (mbed firmware) or 64
/// (Teensy), report number 0.
///
/// hidapi allocates the text of a failure, and the kernel's write() to a hidraw node sleeps until
/// the transfer has ended: up to a frame, and 5 s if the device takes nothing. So one thread
/// reads and another writes, always the newest packet. The servo touches only their mailboxes and,
/// in `send`, a semaphore, which any thread and any signal handler may raise. A device that is
/// unplugged closes the port.
class HidPort final : public MailboxPort {
 public:
  /// `where`: a node (/dev/hidraw0), a serial number, or empty for the only arm. Tries for
  /// `patience_ms` while none is there, or until `stop`. Throws std::runtime_error with one line.
  HidPort(const std::string& where, int patience_ms, const std::atomic<bool>& stop,
          IoThread io = {});
  ~HidPort() override;
  HidPort(const HidPort&) = delete;
  HidPort& operator=(const HidPort&) = delete;

  bool send(std::span<const std::uint8_t> packet) noexcept override;
  [[nodiscard]] std::vector<LinkCounter> counters() const override;

 private:
  [[nodiscard]] bool open(const std::string& where);
  void close() noexcept;
  void read_reports() noexcept;
  void write_commands() noexcept;

  IoThread io_;  ///< of both threads
  hid_device_* device_ = nullptr;
  std::size_t packet_bytes_ = 0;   ///< of this firmware; shorter packets are filled up
  std::atomic<bool> gone_{false};  ///< a packet after the end could not be sent
  sem_t raised_{};                 ///< once per packet, and once to stop
  std::atomic<std::uint64_t> packets_{0}, overflow_{0};  ///< as UsbLinkStats
  std::atomic<std::uint64_t> commands_{0};               ///< packets that the kernel has sent
  std::thread reader_, writer_;
};

/// What follows "hid" in `--port hid[:WHERE]`. Throws std::runtime_error with one line.
[[nodiscard]] std::string parse_hid_port(std::string_view text);

}  // namespace kerf
