// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "hil/device/device_model.hpp"
#include "hil/device/plant.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/omni.hpp"

/// The emulated PHANTOM Omni: its kinematics, and its packets around the shared mechanics.
namespace kerf {

/// Link lengths of one arm, mm. The defaults are those of the constants page.
struct OmniLinks {
  double upper_mm = omni::kUpperLinkMm;
  double forearm_mm = omni::kForearmMm;
  double origin_height_mm = omni::kOriginHeightMm;
  double origin_depth_mm = omni::kOriginDepthMm;
};

/// Its mechanical end stops, rad; the elbow's angle is q3 - q2.
///
/// That of the forearm is ours. Where the thigh's and the elbow's last stops meet, the arm is
/// stretched up and the tip is 5 mm behind the turret's axis: no turning of the turret leads there,
/// and on the axis no torque balances a force on the tip. With it the tip stays 10 mm in front.
struct OmniStops {
  double turret_rad = 0.98;  ///< to both sides
  double thigh_min_rad = 0.0;
  double thigh_max_rad = 1.75;
  double elbow_min_rad = -0.81;
  double elbow_max_rad = 1.25;
  double forearm_max_rad = 2.88;
};

/// The emulator's kinematics of the Omni: double precision, elbow up, written from the geometry and
/// not from the controller's formulas, so that a sign error on one side cannot hide on the other.
///
/// The arm is two links in a vertical plane that the turret turns about the y axis:
///
///                     elbow               q2  thigh above the horizontal
///                   L1 /\  L2             q3  forearm from straight down, outwards, absolute
///           shoulder  /  \                    (elbow angle = q3 - q2)
///        y |         o    * tip           q1  turret, positive to the left
///          '-- reach ------->
///
/// Any thread, no state besides the lengths. Points out of reach give the nearest elbow angle.
class OmniArm {
 public:
  using Jacobian = Transform<double, DeviceSpace, JointSpace>;

  explicit OmniArm(const OmniLinks& links = {}, const OmniStops& stops = {}) noexcept
      : links_(links), stops_(stops) {}

  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept;
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept;
  /// d tip / d q, mm per rad. Regular wherever `within_limits` holds.
  [[nodiscard]] Jacobian jacobian(JointVec<double> q) const noexcept;

  /// The force that joint torques exert at a free tip: J^T F = torque.
  [[nodiscard]] DeviceVec<double> tip_force_n(JointVec<double> q,
                                              JointVec<double> torque_nmm) const noexcept;
  [[nodiscard]] DeviceVec<double> tip_force_n(const ArmPose& pose,
                                              JointVec<double> torque_nmm) const noexcept {
    return tip_force_n(pose.q, torque_nmm);
  }
  /// Joint rates of a tip velocity.
  [[nodiscard]] JointVec<double> joint_rates(JointVec<double> q,
                                             DeviceVec<double> velocity) const noexcept;
  [[nodiscard]] JointVec<double> joint_rates(const ArmPose& pose,
                                             DeviceVec<double> velocity) const noexcept {
    return joint_rates(pose.q, velocity);
  }

  [[nodiscard]] bool within_limits(JointVec<double> q) const noexcept;

  /// Puts an arm beyond an end stop back onto it and takes away the speed into the stop, so that
  /// the tip never gains energy. Returns whether a stop was met; joints and tip then agree.
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept;

 private:
  OmniLinks links_;
  OmniStops stops_;
};

/// One Omni and one hand.
struct OmniParams : PlantParams {
  OmniLinks links;
  std::array<double, 3> dock_rad = omni::kDockRad;
  /// Encoder counts in the inkwell after power-up: near the ends, so that they wrap in use.
  std::array<int, 3> encoder_offset{32760, -32700, 32700};
  bool pot_noise = false;  ///< replaces the low 5 bits of the pots by seeded noise
  std::uint32_t seed = 1;
};

/// The device. It has a packet whenever the host requests one. Its behaviour when host packets stop
/// is not known, so both possibilities can be tested. The emulated hand takes the host for
/// calibrated once the host has switched the motors on, or the light of the inkwell to steady.
class OmniModel final : public DeviceModel {
 public:
  explicit OmniModel(const OmniParams& params = {});

  /// A host packet that arrived; it acts from the next cycle on.
  void command(const OmniCommand& command) noexcept;
  /// The packet of this moment; every call counts one packet.
  [[nodiscard]] OmniReport next_report() noexcept;

  bool receive(std::span<const std::uint8_t> packet) noexcept override;
  void step(const HandGoal& hand) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;
  [[nodiscard]] const char* name() const noexcept override { return "omni"; }
  [[nodiscard]] bool motors_on() const noexcept override { return command_.motors_on; }
  [[nodiscard]] Calibration calibration() const noexcept override;
  [[nodiscard]] HandRoute route() const override;
  [[nodiscard]] const PlantState& state() const noexcept override { return plant_.state(); }
  [[nodiscard]] const PlantParams& params() const noexcept override { return params_; }

  [[nodiscard]] const OmniArm& arm() const noexcept { return plant_.arm(); }
  [[nodiscard]] DeviceVec<double> dock_tip_mm() const noexcept { return plant_.rest().tip_mm; }
  [[nodiscard]] OmniCommand::Light light() const noexcept { return command_.light; }

 private:
  [[nodiscard]] std::uint16_t noisy(std::uint16_t pot) noexcept;

  OmniParams params_;
  ArmPlant<OmniArm> plant_;
  std::array<double, 3> orientation_rad_{};
  bool button1_ = false;
  bool button2_ = false;
  OmniCommand command_;
  std::uint32_t packets_ = 0;
  omni::ReportBytes packet_{};
  std::mt19937 noise_;
};

}  // namespace kerf
