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
#include "shared/wire/cartesian.hpp"
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
  ///
  /// Once the device's side of the link has ended, every later command is neutral.
  [[nodiscard]] DeviceReport read() noexcept;

  /// Calls of `read` a second.
  void set_rate(int rate_hz) noexcept {
    most_still_reads_ = static_cast<std::uint32_t>(kStillS * rate_hz);
  }

  /// A device without a number in its packets may repeat an old one without end. After so long
  /// under torque without a change of its position its reports are not fresh, until the position
  /// changes or the motors are off. An orientation or a button that changes proves nothing about
  /// the position, which has a sensor of its own.
  ///
  /// No shorter, since an arm may truly stand still: its friction (0.2 to 0.3 N) hides the tremor
  /// of the hand that holds it (0.1 mm on a grip of 0.5 N/mm), until the hand's force drifts by as
  /// much, and a weight is measured at an arm that rests for two seconds (docs/first-hour.md). Such
  /// an arm answers the fading force by a motion, or loses it.
  static constexpr double kStillS = 3.0;
  /// For a measurement, whose emulated hand may stand still under force without end.
  void allow_stillness() noexcept { most_still_reads_ = UINT32_MAX; }

  /// Sends the motor counts of this tick, with the lights of the phase. On a half-duplex link a
  /// packet that switches the motors off goes out of turn.
  void command(const ServoOutput& output) noexcept;

  /// Motors off now: one packet. False when it could not be sent. Any thread, any signal handler.
  bool release() const noexcept;

  /// Motors off for good: every later command is neutral too. As `release`.
  bool stay_released() noexcept;

  /// `stay_released` by `send_last` of the port, for a process that may be about to end.
  bool release_for_good() noexcept;

  [[nodiscard]] bool wait(int milliseconds) noexcept { return port_.wait(milliseconds); }
  /// Packets missing by the device's own counter; 0 if it has none.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Packets that are no report, old or repeated, and ticks of reports that stand still.
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
  /// Whether packets have a number, by which `take` rejects old ones.
  [[nodiscard]] virtual bool are_numbered() const noexcept { return false; }
  /// The packet that switches the motors off. Any thread.
  [[nodiscard]] virtual std::size_t compose_release(Packet& packet) const noexcept = 0;

  std::uint64_t lost_ = 0;
  std::uint32_t silent_reads_ = 0;  ///< calls of `read` since the last fresh report

 private:
  static constexpr int kMaxDrain = 64;  // 8 ms of an 8 kHz stream

  void follow_change(const DeviceReport& before) noexcept;

  PacketPort& port_;
  std::atomic<bool> released_{false};
  bool forcing_ = false;  ///< by the last command
  bool pushing_ = false;  ///< and a motor with torque
  DeviceReport last_;
  std::uint64_t refused_ = 0;
  std::uint32_t still_reads_ = 0;  ///< under torque, in which the position has not changed
  std::uint32_t most_still_reads_ = static_cast<std::uint32_t>(kStillS * 1000);
};

/// The driver of a device; `port` outlives it. `encoder_sign` is for a
/// `WoodenDriver`.
[[nodiscard]] std::unique_ptr<DeviceDriver> make_driver(
    Personality personality, PacketPort& port,
    const std::optional<std::array<double, 3>>& encoder_sign = {}, int rate_hz = 1000);

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

/// The numbers of a device that counts its own packets.
///
/// A counter up to kNear ahead of the last one is the next packet, and counts the missing ones. One
/// that is farther ahead may be a wrong bit, so it waits for a second packet that continues it; the
/// first is refused then. Every other one is of an old packet, or of a device that counts anew and
/// whose encoders may do so too: it is believed when it is continued and kNear calls of `read` had
/// no report. At any rate of the servo these are 20 ms or more, after which `stale_input` is
/// latched: neither moves the tip while the motors are on.
class PacketNumbers {
 public:
  /// Whether a packet with this counter is the newest. `silent_reads`: calls of `read` without a
  /// report before it.
  [[nodiscard]] bool is_newest(std::uint32_t counter, std::uint32_t silent_reads) noexcept;
  /// Packets that are missing so far.
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }

 private:
  bool seen_ = false;
  std::uint32_t newest_ = 0;
  std::uint64_t missing_ = 0;
  std::optional<std::uint32_t> refused_counter_;  ///< of the last packet, if it was refused
};

/// The Omni: a stream of reports, counted by the device itself. The inkwell's light: steady once
/// calibrated, slow flash while waiting for the stylus, fast flash in a fault.
class OmniDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  [[nodiscard]] bool are_numbered() const noexcept override { return true; }

  PacketNumbers numbers_;
};

/// A Cartesian device: numbered reports of a pose in kerf's own packets, whoever makes them. Old
/// ones are refused; but the numbers are those of an adapter, which counts on if its device stands
/// still, so a position that stands still under force is no report here too. A position that 16
/// bits of counts cannot hold is refused, so nothing wraps. An unpowered device counts as not
/// homed: its motors stay off.
class CartesianDriver final : public DeviceDriver {
 public:
  CartesianDriver(PacketPort& port, int step_um) noexcept : DeviceDriver(port), step_um_(step_um) {}

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  int step_um_;
  PacketNumbers numbers_;
  std::uint32_t newest_ = 0;
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
  bool seen_ = false;
  /// After the first report the size of the device's own packets: another one is refused. The
  /// watchdog and signal handlers read it.
  std::atomic<std::size_t> packet_bytes_{wooden::kPacketBytes};
  bool button_ = false;  ///< of the newest report
  /// Reports with the button in a row. Once homed, the encoders are set to what they are in the
  /// first and then in each 64th alone, to release the button: a set takes back what the arm moved
  /// meanwhile, and makes an error of a reading last.
  std::uint32_t button_reports_ = 0;
  bool set_due_ = false;
  std::array<std::int16_t, 6> counts_{};  ///< of the newest report
  Counts joints_{};                       ///< of a, b, c in the joints' sense
  bool set_sent_ = false;  ///< encoders were set to home since the button was pressed
  bool homed_ = false;
  bool at_home_ = false;  ///< and has not left the pose since
};

}  // namespace kerf
