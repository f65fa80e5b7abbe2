// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "controller/device/packet_port.hpp"
#include "controller/servo/device_report.hpp"
#include "controller/servo/servo_output.hpp"

namespace kerf {

/// The Omni behind a packet port: reports in, motor counts out.
///
/// Servo thread only, except where said. Calibration, limits and the decision whether motors may be
/// on belong to the servo step; the driver translates and counts losses by the device's own packet
/// counter.
class OmniDriver {
 public:
  explicit OmniDriver(PacketPort& port) noexcept : port_(port) {}

  /// Newest report; `fresh` is false when nothing has arrived since the last call. At most
  /// `kMaxDrain` packets are taken, so a flood cannot hold the servo.
  [[nodiscard]] DeviceReport read() noexcept;

  /// Sends the motor counts of this tick. The inkwell's light: steady once calibrated, slow flash
  /// while waiting for the stylus, fast flash in a fault.
  void command(const ServoOutput& output) noexcept;

  /// Motors off now: one packet. False when it could not be sent. Any thread, any signal handler.
  bool release() const noexcept;

  /// Motors off, and off they stay: every later command is neutral too. As `release`.
  bool release_for_good() noexcept {
    released_.store(true);
    return release();
  }

  [[nodiscard]] bool wait(int milliseconds) noexcept { return port_.wait(milliseconds); }
  /// Packets that the device numbered and we never saw; and packets that were not reports.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  static constexpr int kMaxDrain = 64;  // 8 ms of an 8 kHz stream

  PacketPort& port_;
  std::atomic<bool> released_{false};
  DeviceReport last_;
  bool seen_ = false;
  std::uint64_t lost_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace kerf
