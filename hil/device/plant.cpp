// SPDX-License-Identifier: Apache-2.0
#include "hil/device/plant.hpp"

#include <numbers>

namespace kerf {
namespace {

constexpr double kNmmPerNm = 1000.0;

}  // namespace

Rotors::Rotors(const PlantParams& params, JointVec<double> start_rad) noexcept
    : inertia_kg_m2_{params.joint_inertia_kg_m2[0], params.joint_inertia_kg_m2[1],
                     params.joint_inertia_kg_m2[2]},
      heavy_(inertia_kg_m2_.x > 0 && inertia_kg_m2_.y > 0 && inertia_kg_m2_.z > 0),
      angular_hz_(heavy_ ? 2 * std::numbers::pi * params.mode_hz : 0.0),
      damping_ratio_(params.mode_damping_ratio),
      angle_rad_(start_rad) {}

JointVec<double> Rotors::momentum_of(JointVec<double> rates) const noexcept {
  constexpr double kMmPerM = 1000.0;
  return JointVec<double>{inertia_kg_m2_.x * rates.x, inertia_kg_m2_.y * rates.y,
                          inertia_kg_m2_.z * rates.z} *
         (kNmmPerNm * kMmPerM);
}

JointVec<double> Rotors::drive(JointVec<double> motor_nmm, JointVec<double> link_rad,
                               JointVec<double> link_rates) noexcept {
  if (!flexible()) return motor_nmm;
  // A kick between two half drifts, as the tip's: second order in the step.
  angle_rad_ = angle_rad_ + rates_ * (kStepS / 2);
  const auto one = [&](double inertia, double motor, double twist, double twist_rate,
                       double& rate) {
    const double acceleration =
        angular_hz_ * angular_hz_ * twist + 2 * damping_ratio_ * angular_hz_ * twist_rate;
    const double spring = inertia * acceleration * kNmmPerNm;
    rate += (motor - spring) / (inertia * kNmmPerNm) * kStepS;
    return spring;
  };
  const JointVec<double> twist = angle_rad_ - link_rad;
  const JointVec<double> twist_rate = rates_ - link_rates;
  const JointVec<double> reaching{
      one(inertia_kg_m2_.x, motor_nmm.x, twist.x, twist_rate.x, rates_.x),
      one(inertia_kg_m2_.y, motor_nmm.y, twist.y, twist_rate.y, rates_.y),
      one(inertia_kg_m2_.z, motor_nmm.z, twist.z, twist_rate.z, rates_.z)};
  angle_rad_ = angle_rad_ + rates_ * (kStepS / 2);
  return reaching;
}

}  // namespace kerf
