// SPDX-License-Identifier: Apache-2.0
#include "hil/device/falcon.hpp"

#include <algorithm>
#include <cmath>

#include "shared/numeric/quick_elementary.hpp"

namespace kerf {
namespace {

constexpr double kShinEndsMm = falcon::kShinEndMm + falcon::kKneeEndMm;

/// The loop of one leg for one position of the grip.
struct Leg {
  double cosine;     ///< of the leg's azimuth
  double sine;       //
  double out;        ///< u + c
  double rise;       ///< w
  double across;     ///< v + f
  double shin_mm;    ///< b sin t3: the shin's length in the leg's plane
  double length_mm;  ///< L

  Leg(std::size_t index, DeviceVec<double> tip_mm) noexcept
      : cosine(quick::cosine(falcon::kLegAzimuthRad[index])),
        sine(quick::sine(falcon::kLegAzimuthRad[index])),
        out(cosine * tip_mm.x + sine * tip_mm.y - falcon::kHipOutMm + falcon::kPlateOutMm),
        rise(tip_mm.z + falcon::kOriginDepthMm),
        across(cosine * tip_mm.y - sine * tip_mm.x - falcon::kHipAcrossMm + falcon::kPlateAcrossMm),
        shin_mm(std::sqrt(std::max(0.0, falcon::kShinMm * falcon::kShinMm - across * across))),
        length_mm(kShinEndsMm + shin_mm) {}

  /// Whether it reaches the grip with a bent knee. At the border the joint has no gradient.
  [[nodiscard]] bool bends() const noexcept {
    return std::abs(across) < falcon::kShinMm && square_of_root() > 0;
  }
  [[nodiscard]] double joint_rad() const noexcept {
    const double root = std::sqrt(std::max(0.0, square_of_root()));
    // The lower one of two angles, (-f - root) / (g - e), written so that it never divides by zero:
    // the grip is in front of the hips, f < 0.
    return 2 * quick::arctangent(g() + e(), root - f());
  }

  // The loop of the leg is e cos t + f sin t + g = 0.
  [[nodiscard]] double e() const noexcept { return -2 * falcon::kThighMm * out; }
  [[nodiscard]] double f() const noexcept { return -2 * falcon::kThighMm * rise; }
  [[nodiscard]] double g() const noexcept {
    return out * out + rise * rise + falcon::kThighMm * falcon::kThighMm - length_mm * length_mm;
  }
  [[nodiscard]] double square_of_root() const noexcept { return e() * e() + f() * f() - g() * g(); }

  /// d t / d tip: minus the loop's derivative by the tip over that by t.
  [[nodiscard]] DeviceVec<double> gradient(double joint_rad) const noexcept {
    const double knee_out = falcon::kThighMm * quick::cosine(joint_rad);
    const double knee_rise = falcon::kThighMm * quick::sine(joint_rad);
    const double reach = out - knee_out;
    const double lift = rise - knee_rise;
    const double by_across = length_mm * across / shin_mm;
    const double by_joint = reach * knee_rise - lift * knee_out;
    return DeviceVec<double>{reach * cosine - by_across * sine, reach * sine + by_across * cosine,
                             lift} *
           (-1.0 / by_joint);
  }
};

/// Counts of the three legs, before they are quantised.
std::array<double, 3> counts_of(JointVec<double> q) noexcept {
  const auto count = [](double angle_rad) {
    return (angle_rad - falcon::kZeroRad) / falcon::kRadPerCount;
  };
  return {count(q.x), count(q.y), count(q.z)};
}

bool reaches(DeviceVec<double> tip_mm) noexcept {
  return Leg(0, tip_mm).bends() && Leg(1, tip_mm).bends() && Leg(2, tip_mm).bends();
}

}  // namespace

JointVec<double> FalconArm::joints_rad(DeviceVec<double> tip_mm) const noexcept {
  return {Leg(0, tip_mm).joint_rad(), Leg(1, tip_mm).joint_rad(), Leg(2, tip_mm).joint_rad()};
}

FalconArm::Gradients FalconArm::gradients(const ArmPose& pose) noexcept {
  return {Leg(0, pose.tip_mm).gradient(pose.q.x), Leg(1, pose.tip_mm).gradient(pose.q.y),
          Leg(2, pose.tip_mm).gradient(pose.q.z)};
}

DeviceVec<double> FalconArm::tip_force_n(const ArmPose& pose,
                                         JointVec<double> torque_nmm) const noexcept {
  const Gradients by_tip = gradients(pose);
  return by_tip[0] * torque_nmm.x + by_tip[1] * torque_nmm.y + by_tip[2] * torque_nmm.z;
}

JointVec<double> FalconArm::joint_rates(const ArmPose& pose,
                                        DeviceVec<double> velocity) const noexcept {
  const Gradients by_tip = gradients(pose);
  return {dot(by_tip[0], velocity), dot(by_tip[1], velocity), dot(by_tip[2], velocity)};
}

DeviceVec<double> FalconArm::tip_mm(JointVec<double> q) const noexcept {
  constexpr int kMaxIterations = 50;
  constexpr double kDoneMm = 1e-10;
  ArmPose pose{joints_rad({}), {}};
  for (int i = 0; i < kMaxIterations; ++i) {
    const Gradients by_tip = gradients(pose);
    Transform<double, JointSpace, DeviceSpace> rates;
    for (std::size_t k = 0; k < 3; ++k) rates.row[k] = {by_tip[k].x, by_tip[k].y, by_tip[k].z};
    DeviceVec<double> step = solve(rates, q - pose.q);
    // Beyond the reach of a leg there is no gradient to come back by, and a step that leads away
    // from the joints may end at another grip with the same ones.
    constexpr double kRounding = 1e-9;
    const double off_rad = norm(q - pose.q) + kRounding;
    const auto leads_on = [&] {
      const DeviceVec<double> next = pose.tip_mm + step;
      return reaches(next) && norm(q - joints_rad(next)) <= off_rad;
    };
    for (int halves = 0; halves < 50 && !leads_on(); ++halves) step = step * 0.5;
    pose.tip_mm = pose.tip_mm + step;
    pose.q = joints_rad(pose.tip_mm);
    if (norm(step) < kDoneMm) break;
  }
  return pose.tip_mm;
}

bool FalconArm::stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                               DeviceVec<double>& velocity) const noexcept {
  if (within_limits(tip_mm)) return false;
  const DeviceVec<double> outwards = tip_mm * (1.0 / norm(tip_mm));
  tip_mm = outwards * falcon::kReachMm;
  q = joints_rad(tip_mm);
  stop_speed(velocity, outwards, 1);
  return true;
}

FalconModel::FalconModel(const FalconParams& params)
    : params_(params), plant_(FalconArm{}, params, FalconArm{}.joints_rad(params.rest_tip_mm)) {
  const auto counts = counts_of(plant_.encoder_rad());
  for (std::size_t i = 0; i < 3; ++i) {
    power_up_count_[i] = static_cast<int>(std::floor(counts[i]));
  }
}

bool FalconModel::receive(std::span<const std::uint8_t> packet) noexcept {
  const auto decoded = falcon::decode_command(packet);
  if (decoded) command(*decoded);
  return decoded.has_value();
}

void FalconModel::command(const FalconCommand& command) noexcept {
  const auto torque = [&](std::size_t i) {
    const int count =
        std::clamp<int>(command.motor[i], -falcon::kMotorCountMax, falcon::kMotorCountMax);
    return count * params_.torque_nmm_per_count[i];
  };
  plant_.motors().command({torque(0), torque(1), torque(2)});
  driven_ = command.motor != std::array<std::int16_t, 3>{};
  homing_.packet(command.homing);
  owed_ = std::min(owed_ + 1, kMaxOwed);
}

void FalconModel::step(const HandGoal& hand) noexcept {
  buttons_ = static_cast<std::uint8_t>((hand.button1 ? falcon::kButtonCentre : 0) |
                                       (hand.button2 ? falcon::kButtonForward : 0));
  plant_.cycle(hand);
  homing_.watch(plant_.encoder_rad());
  if (frames_.step()) due_ = owed_ > 0;
}

Calibration FalconModel::calibration() const noexcept {
  if (homing_.complete()) return Calibration::done;
  return homing_.asked() ? Calibration::needs_hand : Calibration::not_begun;
}

HandRoute FalconModel::route() const {
  // Out and in above the workpiece; then the centre button, for hosts that wait for it.
  HandStep press;
  press.seconds = 0.15;
  press.button = 1;
  return {.rest_tip_mm = plant_.rest().tip_mm,
          .calibration = {hand_move({0, 20, 35}, 0.2), hand_move({0, 20, -35}, 0.3), press},
          .detour = HandRoute::Detour{.lift_mm = 0, .y_mm = 20, .z_mm = -20},
          .first_button_parks = true,
          .hand_rad_per_s = params().hand_rad_per_s()};
}

FalconReport FalconModel::report() const noexcept {
  const auto counts = counts_of(plant_.encoder_rad());
  FalconReport report;
  report.homed = homing_.homed();
  for (std::size_t i = 0; i < 3; ++i) {
    report.encoder[i] = encoder_count(report.homed[i] ? 0 : -power_up_count_[i], counts[i]);
  }
  report.buttons = buttons_;
  return report;
}

std::span<const std::uint8_t> FalconModel::next_packet() noexcept {
  if (!due_) return {};
  due_ = false;
  --owed_;
  packet_ = encode(report());
  return packet_;
}

}  // namespace kerf
