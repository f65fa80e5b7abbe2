// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

#include "hil/devmodel/omni_arm.hpp"
#include "hil/devmodel/tip_mass.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/omni_packet.hpp"

namespace kerf {

/// What the device does with its motors when host packets stop: not known of the real one, so both
/// answers can be tested.
enum class OnSilence : std::uint8_t { hold_torque, drop_torque };

inline constexpr int kMaxOutputDelayCycles = 64;

/// One Omni and one hand. Defaults are plausible, to be swept; none is a claim about a unit.
struct OmniParams {
  OmniLinks links;
  std::array<double, 3> dock_rad = omni::kDockRad;
  double tip_mass_kg = 0.045;         ///< apparent, of the data sheet
  double viscous_ns_per_mm = 0.0005;  ///< sweep 0..0.002
  double coulomb_n = 0.1;             ///< sweep 0..0.3; the sheet names 0.26 of back-drive friction

  std::array<double, 3> torque_nmm_per_count{0.342, 0.342, 0.342};  ///< 0.70 N m at full scale
  double current_lag_s = 0;     ///< time constant of the current loop; 0 = none
  int output_delay_cycles = 0;  ///< 0..kMaxOutputDelayCycles
  OnSilence on_silence = OnSilence::hold_torque;
  int silence_cycles = 800;  ///< 100 ms without a command count as silence

  /// Encoder counts in the inkwell after power-up: near the ends, so that they wrap in use.
  std::array<int, 3> encoder_offset{32760, -32700, 32700};
  bool pot_noise = false;  ///< replaces the low 5 bits of the pots by seeded noise
  std::uint32_t seed = 1;

  double hand_stiffness_n_per_mm = 0.5;
  double hand_damping_ns_per_mm = 0.005;
  double hand_mass_kg = 0.1;  ///< moves with the tip
};

/// What the hand wants during one bus cycle.
struct HandGoal {
  bool in_inkwell = true;       ///< the stylus rests (or shall come to rest) in the inkwell
  DeviceVec<double> target_mm;  ///< ignored in the inkwell
  /// Gimbal yaw, pitch, roll in rad; the pitch counts from an upright shaft.
  std::array<double, 3> orientation_rad{};
  bool button1 = false;
  bool button2 = false;
};

/// The PHANTOM Omni as its host sees it: bytes apart, everything between a motor word and an
/// encoder count, in fixed steps of one bus cycle (125 us) and without a clock.
///
/// Per cycle: delay and current lag of the motors, torque to tip force by J^-T, then four steps of
/// the tip (mass, friction, hand spring, end stops). Weight counts as balanced. One thread; never
/// allocates; the same calls give the same counts, bit for bit on one machine.
class OmniModel {
 public:
  explicit OmniModel(const OmniParams& params = {});

  /// A host packet that arrived; it acts from the next cycle on.
  void command(const OmniCommand& command) noexcept;
  /// One bus cycle.
  void step(const HandGoal& hand) noexcept;
  /// The packet of this moment; every call counts one packet.
  [[nodiscard]] OmniReport next_report() noexcept;

  [[nodiscard]] const OmniArm& arm() const noexcept { return arm_; }
  [[nodiscard]] DeviceVec<double> tip_mm() const noexcept { return tip_mm_; }
  [[nodiscard]] DeviceVec<double> velocity_mm_per_s() const noexcept { return velocity_; }
  [[nodiscard]] JointVec<double> joints_rad() const noexcept { return joints_rad_; }
  /// Of the motors at the tip, in the latest step.
  [[nodiscard]] DeviceVec<double> motor_force_n() const noexcept { return motor_force_n_; }
  [[nodiscard]] DeviceVec<double> dock_tip_mm() const noexcept { return dock_tip_mm_; }
  [[nodiscard]] bool docked() const noexcept { return docked_; }
  [[nodiscard]] bool motors_on() const noexcept { return command_.motors_on; }
  [[nodiscard]] OmniCommand::Light light() const noexcept { return command_.light; }

 private:
  [[nodiscard]] JointVec<double> wanted_torque() const noexcept;
  void move_tip(const HandGoal& hand, DeviceVec<double> target_mm,
                DeviceVec<double> target_velocity) noexcept;
  [[nodiscard]] std::uint16_t noisy(std::uint16_t pot) noexcept;

  OmniParams params_;
  OmniArm arm_;
  TipMass mass_;
  JointVec<double> dock_rad_;
  DeviceVec<double> dock_tip_mm_;
  double lag_decay_;

  JointVec<double> joints_rad_;  ///< of tip_mm_
  DeviceVec<double> tip_mm_;
  DeviceVec<double> velocity_;
  DeviceVec<double> target_mm_;
  DeviceVec<double> motor_force_n_;
  JointVec<double> torque_nmm_;
  bool docked_ = true;
  std::array<double, 3> orientation_rad_{};
  bool button1_ = false;
  bool button2_ = false;

  OmniCommand command_;
  int cycles_since_command_ = 0;
  std::array<JointVec<double>, kMaxOutputDelayCycles + 1> delayed_nmm_{};
  std::size_t delay_head_ = 0;

  std::uint32_t packets_ = 0;
  std::mt19937 noise_;
};

}  // namespace kerf
