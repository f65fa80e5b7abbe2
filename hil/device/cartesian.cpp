// SPDX-License-Identifier: Apache-2.0
#include "hil/device/cartesian.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "shared/numeric/quick_elementary.hpp"

namespace kerf {
namespace {

/// Quaternions as x, y, z, w: first `b`, then `a`.
std::array<double, 4> composed(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

/// The tool in a hand's goal: Ry(-yaw) Rx(pitch) Ry(roll), as the Omni's wrist on an arm that
/// points straight ahead.
std::array<double, 4> turned(const std::array<double, 3>& yaw_pitch_roll) {
  const auto about = [](std::size_t axis, double angle) {
    std::array<double, 4> q{0, 0, 0, quick::cosine(angle / 2)};
    q[axis] = quick::sine(angle / 2);
    return q;
  };
  return composed(composed(about(1, -yaw_pitch_roll[0]), about(0, yaw_pitch_roll[1])),
                  about(1, yaw_pitch_roll[2]));
}

JointVec<double> rest_of(const cartesian::Figures& figures) {
  return {figures.rest_mm[0], figures.rest_mm[1], figures.rest_mm[2]};
}

}  // namespace

bool CartesianArm::stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                                  DeviceVec<double>& velocity) const noexcept {
  const auto stop = [](double& place, double& speed, double low, double high) {
    if (place >= low && place <= high) return false;
    const bool is_above = place > high;
    place = is_above ? high : low;
    if ((speed > 0) == is_above) speed = 0;
    return true;
  };
  bool is_met = stop(tip_mm.x, velocity.x, low_mm_.x, high_mm_.x);
  is_met = stop(tip_mm.y, velocity.y, low_mm_.y, high_mm_.y) || is_met;
  is_met = stop(tip_mm.z, velocity.z, low_mm_.z, high_mm_.z) || is_met;
  q = joints_rad(tip_mm);
  return is_met;
}

CartesianParams::CartesianParams(Personality which) : personality(which) {
  torque_nmm_per_count.fill(cartesian::kNewtonsPerCount);
  const cartesian::Figures figures = *cartesian::figures(which);
  tip_mass_kg = figures.tip_mass_kg;
  coulomb_n = figures.coulomb_n;
}

CartesianModel::CartesianModel(const CartesianParams& params)
    : params_(params),
      figures_(*cartesian::figures(params.personality)),
      plant_(CartesianArm(figures_), params, rest_of(figures_)) {}

const char* CartesianModel::name() const noexcept {
  return word_of(params_.personality).data();  // a literal
}

bool CartesianModel::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto decoded = decode_cartesian_command(packet);
  if (decoded) command(*decoded);
  is_asked_ = is_asked_ || decoded;
  return decoded.has_value();
}

void CartesianModel::command(const CartesianCommand& command) noexcept {
  command_ = command;
  const double peak_n = force_figures(params_.personality).peak_n;
  JointVec<double> force_n{command.force_mn[0] * params_.torque_nmm_per_count[0],
                           command.force_mn[1] * params_.torque_nmm_per_count[1],
                           command.force_mn[2] * params_.torque_nmm_per_count[2]};
  const double length = norm(force_n);
  if (length > peak_n) force_n = force_n * (peak_n / length);
  plant_.motors().command(command.force_on && params_.powered ? force_n : JointVec<double>{});
}

void CartesianModel::step(const HandGoal& hand) noexcept {
  if (figures_.has_wrist) {
    if (const auto packed = cartesian::packed_orientation(turned(hand.orientation_rad))) {
      orientation_ = *packed;
    }
  }
  button1_ = hand.button1;
  button2_ = hand.button2;
  plant_.cycle(hand);
}

Calibration CartesianModel::calibration() const noexcept {
  const bool done = command_.force_on || command_.light == CartesianCommand::Light::ready;
  return done ? Calibration::done : Calibration::not_begun;
}

HandRoute CartesianModel::route() const {
  HandRoute route{.rest_tip_mm = plant_.rest().tip_mm,
                  .calibration = {},
                  .detour = {},
                  .hand_rad_per_s = params().hand_rad_per_s()};
  // An inkwell lies beside the workpiece: up, behind it, and over. Others rest above it.
  if (kind_of(params_.personality).has_dock) {
    route.detour = HandRoute::Detour{.lift_mm = 25, .y_mm = 15, .z_mm = -60};
  }
  return route;
}

CartesianReport CartesianModel::next_report() noexcept {
  const JointVec<double> seen = plant_.encoder_rad();
  const DeviceVec<double>& applied = state().motor_force_n;
  const auto count_um = [&](double mm) {
    const double um = mm * 1000.0;
    return static_cast<std::int32_t>(std::floor(um / figures_.quantum_um)) * figures_.quantum_um;
  };
  return {.number = ++packets_,
          .position_um = {count_um(seen.x), count_um(seen.y), count_um(seen.z)},
          .orientation = orientation_,
          .force_mn = {cartesian::packed_n(applied.x), cartesian::packed_n(applied.y),
                       cartesian::packed_n(applied.z)},
          .button1 = button1_,
          .button2 = button2_,
          .parked = docked(),
          .homed = true,
          .powered = params_.powered,
          .age_us = 0};
}

std::span<const std::uint8_t> CartesianModel::next_packet() noexcept {
  if (params_.on_request && !is_asked_) return {};
  is_asked_ = false;
  packet_ = encode(next_report());
  return packet_;
}

}  // namespace kerf
