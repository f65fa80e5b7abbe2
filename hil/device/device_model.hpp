// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "hil/device/hand_script.hpp"
#include "hil/device/plant.hpp"

namespace kerf {

/// How far a host has come with calibrating its device, as far as the device can see.
enum class Calibration : std::uint8_t {
  not_begun,
  needs_hand,  ///< the host waits for the hand: to home the device, to press its button
  done
};

/// One haptic device as its host sees it: packets, and between them mechanics in fixed steps of one
/// bus cycle (125 us). No clock. One thread; allocates only when constructed; the same calls give
/// the same bytes on one machine.
class DeviceModel {
 public:
  virtual ~DeviceModel() = default;

  /// A packet of the host; it acts from the next cycle on. Returns false for bytes that are no
  /// packet of this device: nothing changes then.
  virtual bool receive(std::span<const std::uint8_t> packet) noexcept = 0;
  /// One bus cycle.
  virtual void step(const HandGoal& hand) noexcept = 0;
  /// The packet that is due at this moment, valid until the next call; empty if none is.
  [[nodiscard]] virtual std::span<const std::uint8_t> next_packet() noexcept = 0;

  [[nodiscard]] virtual const char* name() const noexcept = 0;
  /// Whether torques of the host reach the motors.
  [[nodiscard]] virtual bool motors_on() const noexcept = 0;
  [[nodiscard]] virtual Calibration calibration() const noexcept = 0;
  /// Of a Cartesian device: what the servo takes for a count of its position.
  [[nodiscard]] virtual int step_um() const noexcept { return 0; }
  /// How a hand calibrates this device and gets to the start of its script.
  [[nodiscard]] virtual HandRoute route() const = 0;
  [[nodiscard]] virtual const PlantState& state() const noexcept = 0;
  [[nodiscard]] virtual const PlantParams& params() const noexcept = 0;
  [[nodiscard]] DeviceVec<double> tip_mm() const noexcept { return state().pose.tip_mm; }
  [[nodiscard]] JointVec<double> joints_rad() const noexcept { return state().pose.q; }
  [[nodiscard]] DeviceVec<double> velocity_mm_per_s() const noexcept { return state().velocity; }
  [[nodiscard]] DeviceVec<double> motor_force_n() const noexcept { return state().motor_force_n; }
  /// In the inkwell, or in the rest pose of a device that has none.
  [[nodiscard]] bool docked() const noexcept { return state().at_rest; }
};

}  // namespace kerf
