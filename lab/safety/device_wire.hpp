// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hil/device/plant.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::faults {

using EncoderCounts = std::array<std::int16_t, 3>;

/// The content of a report, in the words of docs/safety.md.
struct ObservedReport {
  EncoderCounts count{};
  bool parked = false;
  bool homed = true;
  friend bool operator==(const ObservedReport&, const ObservedReport&) noexcept = default;
};

/// The motor command of a packet of the host.
struct ObservedCommand {
  std::array<std::int16_t, 3> count{};
  bool motors_on = false;

  [[nodiscard]] bool off() const noexcept { return !motors_on && !has_torque(); }
  [[nodiscard]] bool has_torque() const noexcept { return count != std::array<std::int16_t, 3>{}; }
};

/// The packets of one emulated device as they go over the wire, read by the emulator's geometry:
/// nothing of the controller's is used, so a wrong sign there cannot hide here. One thread.
class DeviceWire {
 public:
  DeviceWire(Personality personality, const std::array<double, 3>& dock_rad);

  /// Empty if it is no report of this device, or a numbered one that is not newer than the last.
  /// `may_count_anew`: it was silent for long, so an older number may be that of a new count.
  [[nodiscard]] std::optional<ObservedReport> report(std::span<const std::uint8_t> packet,
                                                     bool may_count_anew);
  /// Empty if it is no packet of a host.
  [[nodiscard]] std::optional<ObservedCommand> command(std::span<const std::uint8_t> packet);

  /// Where encoders that count so from calibration put the arm; none: it has no such pose.
  [[nodiscard]] std::optional<ArmPose> pose(const EncoderCounts& count) const;
  /// What motors at `count` exert at the tip in that pose.
  [[nodiscard]] DeviceVec<double> force_n(const ArmPose& pose,
                                          const std::array<std::int16_t, 3>& count) const;
  /// Motor counts lie within +- this.
  [[nodiscard]] int count_end() const noexcept { return count_end_; }
  /// Whether the device itself does, so that readings that stand still are known to be new.
  [[nodiscard]] bool numbers_its_packets() const noexcept {
    return device_.streams && device_.kinematics != Kinematics::axes;
  }
  /// Whether a calibration in a wrong pose moves every later one: encoders that count from it.
  [[nodiscard]] bool counts_from_rest() const noexcept { return device_.counts_from_dock; }
  /// Whether it is parked at one place alone, where every calibration must be.
  [[nodiscard]] bool has_dock() const noexcept { return device_.has_dock; }
  /// How far from its first place a joint may rest parked, rad; mm of a Cartesian device. The play
  /// of a stylus in its inkwell.
  [[nodiscard]] double dock_play() const noexcept {
    return device_.kinematics == Kinematics::axes ? 3 : 0.025;
  }
  /// How far the counters of a joint at rest may move from one report to the next.
  [[nodiscard]] int rest_counts() const noexcept { return rest_counts_; }
  /// The farthest that a joint turned from `a` to `b`.
  [[nodiscard]] double turned_rad(const EncoderCounts& a, const EncoderCounts& b) const noexcept;
  /// What such encoders tell at the dock, as the host must think since its last calibration.
  [[nodiscard]] const EncoderCounts& dock_count() const noexcept { return dock_count_; }
  void calibrated_at(const EncoderCounts& count) noexcept { dock_count_ = count; }

 private:
  struct Kind;  ///< what differs between the devices
  [[nodiscard]] static constexpr std::array<Kind, kDeviceKinds.size()> kinds() noexcept;
  [[nodiscard]] static const Kind& kind_of(Personality personality) noexcept;
  using Packet = std::span<const std::uint8_t>;
  [[nodiscard]] std::optional<ObservedReport> omni_report(Packet packet, bool may_count_anew);
  [[nodiscard]] std::optional<ObservedReport> falcon_report(Packet packet, bool may_count_anew);
  [[nodiscard]] std::optional<ObservedReport> wooden_report(Packet packet, bool may_count_anew);
  [[nodiscard]] std::optional<ObservedReport> cartesian_report(Packet packet, bool may_count_anew);
  [[nodiscard]] std::optional<ObservedCommand> omni_command(Packet packet);
  [[nodiscard]] std::optional<ObservedCommand> falcon_command(Packet packet);
  [[nodiscard]] std::optional<ObservedCommand> wooden_command(Packet packet);
  [[nodiscard]] std::optional<ObservedCommand> cartesian_command(Packet packet);
  /// Of a device that numbers its packets.
  [[nodiscard]] bool is_newest(std::uint32_t number, bool may_count_anew);

  const DeviceKind& device_;
  const Kind& kind_;
  int count_end_ = 0;
  int rest_counts_ = 2;  ///< an encoder that jitters at an edge rests
  EncoderCounts dock_count_{};
  std::array<double, 3> zero_rad_{}, rad_per_count_{}, nmm_per_count_{};
  std::optional<std::uint32_t> packet_number_;  ///< of the last report, if it has one
  std::optional<std::uint32_t> far_number_;     ///< of the last packet, if it did not follow that
  bool parked_ = false, encoders_set_ = false;  ///< WoodenHaptics
};

}  // namespace kerf::faults
