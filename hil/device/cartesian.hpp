// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hil/device/device_model.hpp"
#include "hil/device/plant.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/personality.hpp"

/// The emulated Cartesian devices: a tip that moves in a box, and kerf's own packets. Their real
/// mechanics are the vendors' secret, and stay behind their service or library.
namespace kerf {

/// The axes of the device's frame as "joints": mm in place of rad, N in place of N mm. The end
/// stops are the box of the workspace.
class CartesianArm {
 public:
  explicit CartesianArm(const cartesian::Figures& figures) noexcept
      : low_mm_{figures.low_mm[0], figures.low_mm[1], figures.low_mm[2]},
        high_mm_{figures.high_mm[0], figures.high_mm[1], figures.high_mm[2]} {}

  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept {
    return {q.x, q.y, q.z};
  }
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept {
    return {tip_mm.x, tip_mm.y, tip_mm.z};
  }
  [[nodiscard]] DeviceVec<double> tip_force_n(const ArmPose&,
                                              JointVec<double> force_n) const noexcept {
    return {force_n.x, force_n.y, force_n.z};
  }
  [[nodiscard]] JointVec<double> joint_rates(const ArmPose&,
                                             DeviceVec<double> velocity) const noexcept {
    return {velocity.x, velocity.y, velocity.z};
  }
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept;

 private:
  DeviceVec<double> low_mm_, high_mm_;
};

/// One Cartesian device and one hand. `torque_nmm_per_count` is N per mN.
struct CartesianParams : PlantParams {
  explicit CartesianParams(Personality which);
  Personality personality;
  bool powered = true;
  bool on_request = false;  ///< one packet for each command, as a service replies; else at any time
};

/// The device with the vendor's service or library before it: a packet whenever the host requests
/// one. It clamps a force to its peak, applies none without power, and reports what it applies. Its
/// behaviour when the host falls silent is not known, so both possibilities can be tested. The hand
/// takes the host for calibrated once the host has switched the force on, or shows that it is
/// ready.
class CartesianModel final : public DeviceModel {
 public:
  explicit CartesianModel(const CartesianParams& params);

  void command(const CartesianCommand& command) noexcept;
  /// The packet of this moment; every call counts one packet.
  [[nodiscard]] CartesianReport next_report() noexcept;

  bool receive(std::span<const std::uint8_t> packet) noexcept override;
  void step(const HandGoal& hand) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;
  [[nodiscard]] const char* name() const noexcept override;
  [[nodiscard]] bool motors_on() const noexcept override { return command_.force_on; }
  [[nodiscard]] Calibration calibration() const noexcept override;
  [[nodiscard]] int step_um() const noexcept override { return figures_.step_um; }
  [[nodiscard]] HandRoute route() const override;
  [[nodiscard]] const PlantState& state() const noexcept override { return plant_.state(); }
  [[nodiscard]] const PlantParams& params() const noexcept override { return params_; }

 private:
  CartesianParams params_;
  cartesian::Figures figures_;
  ArmPlant<CartesianArm> plant_;
  std::array<std::int16_t, 4> orientation_{0, 0, 0, 32767};
  bool button1_ = false, button2_ = false;
  CartesianCommand command_;
  bool is_asked_ = false;  ///< by a command, since the last packet
  std::uint32_t packets_ = 0;
  cartesian::ReportBytes packet_{};
};

}  // namespace kerf
