// SPDX-License-Identifier: Apache-2.0
#include "hil/device/omni.hpp"

#include <algorithm>
#include <cmath>

#include "shared/numeric/quick_elementary.hpp"

namespace kerf {
namespace {

constexpr int kPotTurn = 1 << 16;

/// Wiper A of a gimbal angle; wiper B is the rest to 2^16. Angles beyond the pot stay at its end.
int wiper_count(std::size_t axis, double angle_rad) noexcept {
  const double ratio = (angle_rad - omni::kGimbalOffsetRad[axis]) / omni::kGimbalSlopeRad[axis];
  return std::clamp(static_cast<int>(std::floor(ratio * kPotTurn + 0.5)), 1, kPotTurn - 1);
}

}  // namespace

DeviceVec<double> OmniArm::tip_mm(JointVec<double> q) const noexcept {
  const double reach = links_.upper_mm * quick::cosine(q.y) + links_.forearm_mm * quick::sine(q.z);
  const double rise = links_.upper_mm * quick::sine(q.y) - links_.forearm_mm * quick::cosine(q.z);
  return {-quick::sine(q.x) * reach, rise + links_.origin_height_mm,
          quick::cosine(q.x) * reach - links_.origin_depth_mm};
}

JointVec<double> OmniArm::joints_rad(DeviceVec<double> tip_mm) const noexcept {
  const double forward = tip_mm.z + links_.origin_depth_mm;
  const double reach = std::sqrt(tip_mm.x * tip_mm.x + forward * forward);
  const double rise = tip_mm.y - links_.origin_height_mm;
  const double a = links_.upper_mm;
  const double b = links_.forearm_mm;
  // The bend is the angle from the forearm's direction up to the thigh's (cosine rule).
  const double cos_bend = (reach * reach + rise * rise - a * a - b * b) / (2 * a * b);
  const double bend = quick::arccosine(std::clamp(cos_bend, -1.0, 1.0));
  const double thigh = quick::arctangent(rise, reach) +
                       quick::arctangent(b * quick::sine(bend), a + b * quick::cosine(bend));
  return {quick::arctangent(-tip_mm.x, forward), thigh, thigh - bend + omni::kPi / 2};
}

OmniArm::Jacobian OmniArm::jacobian(JointVec<double> q) const noexcept {
  const double s1 = quick::sine(q.x);
  const double c1 = quick::cosine(q.x);
  // How reach and rise follow the thigh and the forearm.
  const double reach = links_.upper_mm * quick::cosine(q.y) + links_.forearm_mm * quick::sine(q.z);
  const double reach_by_thigh = -links_.upper_mm * quick::sine(q.y);
  const double reach_by_forearm = links_.forearm_mm * quick::cosine(q.z);
  const double rise_by_thigh = links_.upper_mm * quick::cosine(q.y);
  const double rise_by_forearm = links_.forearm_mm * quick::sine(q.z);
  return {{{{-c1 * reach, -s1 * reach_by_thigh, -s1 * reach_by_forearm},
            {0.0, rise_by_thigh, rise_by_forearm},
            {-s1 * reach, c1 * reach_by_thigh, c1 * reach_by_forearm}}}};
}

DeviceVec<double> OmniArm::tip_force_n(JointVec<double> q,
                                       JointVec<double> torque_nmm) const noexcept {
  return solve(transposed(jacobian(q)), torque_nmm);
}

JointVec<double> OmniArm::joint_rates(JointVec<double> q,
                                      DeviceVec<double> velocity) const noexcept {
  return solve(jacobian(q), velocity);
}

bool OmniArm::within_limits(JointVec<double> q) const noexcept {
  const double elbow = q.z - q.y;
  return std::abs(q.x) <= stops_.turret_rad && q.y >= stops_.thigh_min_rad &&
         q.y <= stops_.thigh_max_rad && elbow >= stops_.elbow_min_rad &&
         elbow <= stops_.elbow_max_rad && q.z <= stops_.forearm_max_rad;
}

bool OmniArm::stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                             DeviceVec<double>& velocity) const noexcept {
  if (within_limits(q)) return false;
  // A stop acts on one angle: a combination of the joints.
  struct Stop {
    JointVec<double> angle_of;
    int side;  // -1 below its range, +1 above, 0 inside
  };
  const auto clamp = [](double& angle, double low, double high) {
    const int side = angle < low ? -1 : angle > high ? 1 : 0;
    angle = std::clamp(angle, low, high);
    return side;
  };
  double elbow = q.z - q.y;
  const int turret_side = clamp(q.x, -stops_.turret_rad, stops_.turret_rad);
  const int thigh_side = clamp(q.y, stops_.thigh_min_rad, stops_.thigh_max_rad);
  const int elbow_side = clamp(elbow, stops_.elbow_min_rad, stops_.elbow_max_rad);
  q.z = q.y + elbow;
  const int forearm_side = clamp(q.z, -omni::kPi, stops_.forearm_max_rad);
  const std::array<Stop, 4> stops{{{{1, 0, 0}, turret_side},
                                   {{0, 1, 0}, thigh_side},
                                   {{0, -1, 1}, elbow_side},
                                   {{0, 0, 1}, forearm_side}}};
  tip_mm = this->tip_mm(q);
  for (const Stop& stop : stops) {
    if (stop.side == 0) continue;
    // It pushes the tip along the gradient of its angle.
    stop_speed(velocity, tip_force_n(q, stop.angle_of), stop.side);
  }
  return true;
}

OmniModel::OmniModel(const OmniParams& params)
    : params_(params),
      plant_(OmniArm(params.links), params,
             {params.dock_rad[0], params.dock_rad[1], params.dock_rad[2]}),
      noise_(params.seed) {}

bool OmniModel::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto decoded = decode_command(packet);
  if (decoded) command(*decoded);
  return decoded.has_value();
}

void OmniModel::command(const OmniCommand& command) noexcept {
  command_ = command;
  const auto torque = [&](std::size_t i) {
    return command.motors_on ? command.motor[i] * params_.torque_nmm_per_count[i] : 0.0;
  };
  plant_.motors().command({torque(0), torque(1), torque(2)});
}

void OmniModel::step(const HandGoal& hand) noexcept {
  orientation_rad_ = hand.orientation_rad;
  button1_ = hand.button1;
  button2_ = hand.button2;
  plant_.cycle(hand);
}

Calibration OmniModel::calibration() const noexcept {
  const bool done = command_.motors_on || command_.light == OmniCommand::Light::steady;
  return done ? Calibration::done : Calibration::not_begun;
}

HandRoute OmniModel::route() const {
  // All of it is inside the elbow's limits, and behind the workpiece.
  return {.rest_tip_mm = dock_tip_mm(),
          .calibration = {},
          .detour = HandRoute::Detour{.lift_mm = 25, .y_mm = 15, .z_mm = -60},
          .hand_rad_per_s = params().hand_rad_per_s()};
}

std::uint16_t OmniModel::noisy(std::uint16_t pot) noexcept {
  if (!params_.pot_noise) return pot;
  constexpr std::uint32_t kNoiseMask = (1u << omni::kPotNoiseBits) - 1;
  return static_cast<std::uint16_t>((pot & ~kNoiseMask) | (noise_() & kNoiseMask));
}

OmniReport OmniModel::next_report() noexcept {
  const JointVec<double> seen = plant_.encoder_rad();
  const JointVec<double>& dock = plant_.rest().q;
  const std::array<double, 3> turned{seen.x - dock.x, seen.y - dock.y, seen.z - dock.z};
  const std::array<double, 3> gimbal{orientation_rad_[0], plant_.link_rad().z + orientation_rad_[1],
                                     orientation_rad_[2]};
  OmniReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    report.encoder[i] = encoder_count(params_.encoder_offset[i],
                                      omni::kEncoderSign[i] * turned[i] / omni::kRadPerCount);
    const int wiper = wiper_count(i, gimbal[i]);
    report.pot_a[i] = noisy(static_cast<std::uint16_t>(wiper));
    report.pot_b[i] = noisy(static_cast<std::uint16_t>(kPotTurn - wiper));
  }
  report.button1 = button1_;
  report.button2 = button2_;
  report.docked = docked();
  report.counter = ++packets_;
  return report;
}

std::span<const std::uint8_t> OmniModel::next_packet() noexcept {
  packet_ = encode(next_report());
  return packet_;
}

}  // namespace kerf
