// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "hil/device/device_model.hpp"
#include "hil/device/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

/// The emulated WoodenHaptics arm: its kinematics, and its packets around the shared mechanics.
namespace kerf {

/// The emulator's kinematics of the WoodenHaptics arm: the Omni's two links with other lengths and
/// other names of the angles (A = -q1, B = pi/2 - q2, C = q3).
///
/// The end stops are ours: turret +-1.0, B -0.35..1.35, the angle between the links (B + C)
/// 0.45..2.6 rad, which keeps the arm away from its folded and its stretched pose, and C up to 2.8,
/// which keeps the tip 8 mm in front of the turret's axis (OmniStops).
class WoodenArm {
 public:
  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept {
    return links_.tip_mm(renamed(q));
  }
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept {
    return renamed(links_.joints_rad(tip_mm));
  }
  [[nodiscard]] DeviceVec<double> tip_force_n(const ArmPose& pose,
                                              JointVec<double> torque_nmm) const noexcept {
    return links_.tip_force_n(renamed(pose.q), turned(torque_nmm));
  }
  [[nodiscard]] JointVec<double> joint_rates(const ArmPose& pose,
                                             DeviceVec<double> velocity) const noexcept {
    return turned(links_.joint_rates(renamed(pose.q), velocity));
  }
  [[nodiscard]] bool within_limits(JointVec<double> q) const noexcept {
    return links_.within_limits(renamed(q));
  }
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept {
    JointVec<double> as_omni = renamed(q);
    if (!links_.stop_at_limits(as_omni, tip_mm, velocity)) return false;
    q = renamed(as_omni);
    return true;
  }

 private:
  static constexpr double kQuarter = std::numbers::pi / 2;
  /// Both ways: the change of names is its own inverse.
  [[nodiscard]] static JointVec<double> renamed(JointVec<double> q) noexcept {
    return {-q.x, kQuarter - q.y, q.z};
  }
  /// Changes the names of torques or rates, both ways.
  [[nodiscard]] static JointVec<double> turned(JointVec<double> v) noexcept {
    return {-v.x, -v.y, v.z};
  }

  OmniArm links_{{.upper_mm = wooden::kUpperLinkMm,
                  .forearm_mm = wooden::kForearmMm,
                  .origin_height_mm = wooden::kShoulderHeightMm - wooden::kOriginHeightMm,
                  .origin_depth_mm = wooden::kOriginDepthMm},
                 {.turret_rad = 1.0,
                  .thigh_min_rad = kQuarter - 1.35,
                  .thigh_max_rad = kQuarter + 0.35,
                  .elbow_min_rad = 0.45 - kQuarter,
                  .elbow_max_rad = 2.6 - kQuarter,
                  .forearm_max_rad = 2.8}};
};

/// One WoodenHaptics arm (plans of 2015) and one hand. A count is a mA.
struct WoodenParams : PlantParams {
  WoodenParams() {
    tip_mass_kg = 0.2;
    coulomb_n = 0.2;
    for (std::size_t i = 0; i < 3; ++i) {
      torque_nmm_per_count[i] =
          wooden::kTorqueNmmPerA2015[i] / 1000.0 * (wooden::kBodyMm[i] / wooden::kCapstanMm);
    }
    on_silence = OnSilence::drop_torque;
    silence_cycles = static_cast<int>(wooden::kWatchdogS * kCyclesPerSecond);
  }
  /// The firmware's counts in the rest pose after power-up: arbitrary, until the host sets them.
  std::array<int, 6> power_up_count{310, -220, 140, 0, 0, 0};
  /// -1: this encoder counts, and this motor turns, the other way, as in some of the makers'
  /// branches.
  std::array<int, 3> encoder_sign{1, 1, 1};
  std::size_t packet_bytes = wooden::kPacketBytes;  ///< or kLongPacketBytes
  bool wireless_button = false;                     ///< shows the hand's first button on encoder d
};

/// The device with its firmware. From the first packet of the host on it reports every
/// 1 ms. Half a second without a packet switches the amplifiers off; the next one switches them on
/// again. The hand rests in the pose in which the arm is calibrated and presses the button; the
/// host answers by setting the encoders, for which the motors get no current.
class WoodenModel final : public DeviceModel {
 public:
  explicit WoodenModel(const WoodenParams& params = {});

  void command(const WoodenCommand& command) noexcept;
  [[nodiscard]] WoodenReport report() const noexcept;

  bool receive(std::span<const std::uint8_t> packet) noexcept override;
  void step(const HandGoal& hand) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;
  [[nodiscard]] const char* name() const noexcept override { return "woodenhaptics"; }
  [[nodiscard]] bool motors_on() const noexcept override;
  [[nodiscard]] Calibration calibration() const noexcept override;
  [[nodiscard]] HandRoute route() const override;
  [[nodiscard]] const PlantState& state() const noexcept override { return plant_.state(); }
  [[nodiscard]] const PlantParams& params() const noexcept override { return params_; }

  [[nodiscard]] const WoodenArm& arm() const noexcept { return plant_.arm(); }

 private:
  /// Of the six encoders, from their zeros; this arm has no gimbal, so the last three stand still.
  [[nodiscard]] std::array<double, 6> turned_counts() const noexcept;

  WoodenParams params_;
  ArmPlant<WoodenArm> plant_;
  std::array<int, 6> zero_count_{};  ///< the firmware's count of an encoder that stands at zero
  bool streaming_ = false;
  bool due_ = false;
  bool calibrated_ = false;
  bool button_flag_ = false;
  bool button_held_ = false;
  bool button1_ = false;
  UsbFrames frames_;
  wooden::PacketBytes packet_{};
};

}  // namespace kerf
