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
#include "controller/servo/servo.hpp"
#include "shared/wire/personality.hpp"
#include "shared/wire/woodenhaptics.hpp"

// The device behind a packet port: the common driver, and one subclass for each device.

namespace kerf {

/// A haptic device behind a packet port: reports in, motor counts out. A subclass translates the
/// packets of one device.
///
/// Servo thread only, unless noted. Limits and the decision whether motors may be on belong to
/// the servo step. Never blocks, allocates or throws.
class DeviceDriver {
 public:
  explicit DeviceDriver(PacketPort& port) noexcept : port_(port) {}
  virtual ~DeviceDriver() = default;
  DeviceDriver(const DeviceDriver&) = delete;
  DeviceDriver& operator=(const DeviceDriver&) = delete;

  /// Sends the packet that a device expects before its first report; once, before the first `read`.
  virtual void start() noexcept {}

  /// Newest report; `fresh` is false when nothing has arrived since the last call. At most
  /// `kMaxDrain` packets are taken, so a flood cannot hold the servo.
  [[nodiscard]] DeviceReport read() noexcept;

  /// Sends the motor counts of this tick, with the lights of the phase. On a half-duplex link a
  /// packet that switches the motors off goes out of turn.
  void command(const ServoOutput& output) noexcept;

  /// Motors off now: one packet. False when it could not be sent. Any thread, any signal handler.
  bool release() const noexcept;

  /// Motors off for good: every later command is neutral too. As `release`.
  bool stay_released() noexcept;

  /// The same by `send_last` of the port, for a process that may be about to end.
  bool release_for_good() noexcept;

  [[nodiscard]] bool wait(int milliseconds) noexcept { return port_.wait(milliseconds); }
  /// Packets missing by the device's own counter; 0 if it has none.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Packets that `take` rejected: not a report, or older than the last one.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 protected:
  static constexpr std::size_t kMaxPacketBytes = 64;
  using Packet = std::array<std::uint8_t, kMaxPacketBytes>;

  /// Translates a packet of the device into the last report. False for another packet or an old
  /// one.
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

/// The driver of a device; `port` outlives it. `encoder_sign` is for a
/// `WoodenDriver`.
[[nodiscard]] std::unique_ptr<DeviceDriver> make_driver(
    Personality personality, PacketPort& port,
    const std::optional<std::array<double, 3>>& encoder_sign = {});

/// The Falcon: it answers each packet once, and sends nothing else. Requests homing until all three
/// axes are homed. The grip's centre button parks: held at rest it calibrates, released it starts
/// the force. Lights: red in a fault, blue while the user has to act (home, park), green while
/// parked or in force.
class FalconDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

  void start() noexcept override { static_cast<void>(release()); }

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  bool homed_ = false;
};

/// The Omni: a stream of reports, counted by the device itself. The inkwell's light: steady once
/// calibrated, slow flash while waiting for the stylus, fast flash in a fault.
///
/// A counter near the last one is valid: a newer one counts the missing packets, an older one is an
/// old packet. A far one may be a wrong bit, so it waits for a second packet that continues it; the
/// first is refused then. A device that starts to count anew is found in the same way, without lost
/// packets.
class OmniDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  /// Whether a packet with this counter is the newest; counts the missing ones before it.
  [[nodiscard]] bool is_newest(std::uint32_t counter) noexcept;

  bool seen_ = false;
  std::uint32_t newest_ = 0;
  std::optional<std::uint32_t> far_;  ///< counter of the last packet, if it was far
};

/// WoodenHaptics: a stream of HID reports that begins with the host's first one.
///
/// Calibration: the user holds the arm in its home pose and presses the button; the driver then
/// sets the device's encoders. The arm counts as parked from the button on until it leaves the
/// pose.
class WoodenDriver final : public DeviceDriver {
 public:
  /// `encoder_sign`: 1 or -1 at each joint. If -1, the device counts down while the joint rotates
  /// in its positive direction (shared/wire/woodenhaptics.hpp), and its motor is reversed too;
  /// published versions of the device differ here. `DeviceReport` and motor counts always use the
  /// positive direction of the joint.
  explicit WoodenDriver(PacketPort& port, std::array<int, 3> encoder_sign = {1, 1, 1}) noexcept
      : DeviceDriver(port), sign_(encoder_sign) {}

  void start() noexcept override { static_cast<void>(release()); }

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  using Counts = std::array<std::int16_t, 3>;
  /// Between the sense of the device and that of the joints.
  [[nodiscard]] Counts turned(const Counts& counts) const noexcept;

  std::array<int, 3> sign_;
  /// Later the size of the device's own packets. The watchdog and signal handlers read it.
  std::atomic<std::size_t> packet_bytes_{wooden::kPacketBytes};
  bool button_ = false;                   ///< of the newest report
  std::array<std::int16_t, 6> counts_{};  ///< of the newest report
  Counts joints_{};                       ///< of a, b, c in the joints' sense
  bool set_sent_ = false;  ///< encoders were set to home since the button was pressed
  bool homed_ = false;
  bool at_home_ = false;  ///< and has not left the pose since
};

}  // namespace kerf
