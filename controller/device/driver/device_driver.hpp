// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "controller/device/port/packet_port.hpp"
#include "controller/servo/device_report.hpp"
#include "controller/servo/servo_output.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// A haptic device behind a packet port: reports in, motor counts out. What differs between devices
/// is the translation of packets; a subclass brings it.
///
/// Servo thread only, except where said. Limits and the decision whether motors may be on belong to
/// the servo step. Never blocks, allocates or throws.
class DeviceDriver {
 public:
  explicit DeviceDriver(PacketPort& port) noexcept : port_(port) {}
  virtual ~DeviceDriver() = default;
  DeviceDriver(const DeviceDriver&) = delete;
  DeviceDriver& operator=(const DeviceDriver&) = delete;

  /// Says what the device waits for before it speaks; once, before the first `read`.
  virtual void start() noexcept {}

  /// Newest report; `fresh` is false when nothing has arrived since the last call. At most
  /// `kMaxDrain` packets are taken, so a flood cannot hold the servo.
  [[nodiscard]] DeviceReport read() noexcept;

  /// Sends the motor counts of this tick, with the lights that tell the phase. Where packets take
  /// turns, one that switches the motors off goes out of turn.
  void command(const ServoOutput& output) noexcept;

  /// Motors off now: one packet. False when it could not be sent. Any thread, any signal handler.
  bool release() const noexcept;

  /// Motors off, and off they stay: every later command is neutral too. As `release`.
  bool stay_released() noexcept;

  /// The same by the port's `send_last`, since the process may be about to end.
  bool release_for_good() noexcept;

  [[nodiscard]] bool wait(int milliseconds) noexcept { return port_.wait(milliseconds); }
  /// Packets that the device numbered and we never saw (0 where it does not number them); and
  /// packets that were not reports.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 protected:
  static constexpr std::size_t kMaxPacketBytes = 64;
  using Packet = std::array<std::uint8_t, kMaxPacketBytes>;

  /// Translates a packet of the device over the last report. False: it is none, or an old one.
  [[nodiscard]] virtual bool take(std::span<const std::uint8_t> packet,
                                  DeviceReport& report) noexcept = 0;
  /// The packet for `output` into `packet`; its size.
  [[nodiscard]] virtual std::size_t compose(const ServoOutput& output, Packet& packet) noexcept = 0;
  /// The packet that switches the motors off. Any thread.
  [[nodiscard]] virtual std::size_t compose_release(Packet& packet) const noexcept = 0;

  std::uint64_t lost_ = 0;

 private:
  static constexpr int kMaxDrain = 64;  // 8 ms of an 8 kHz stream

  PacketPort& port_;
  std::atomic<bool> released_{false};
  bool forcing_ = false;  ///< by the last command
  DeviceReport last_;
  std::uint64_t refused_ = 0;
};

/// The driver of a device; `port` outlives it. `encoder_sign` is a WoodenHaptics'
/// (wooden_driver.hpp).
[[nodiscard]] std::unique_ptr<DeviceDriver> make_driver(
    Personality personality, PacketPort& port,
    const std::optional<std::array<double, 3>>& encoder_sign = {});

}  // namespace kerf
