// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/device_wire.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "hil/device/cartesian.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::faults {
namespace {

constexpr int kHomePoseCounts = 40;  // WoodenHaptics: the home pose, as a hand holds it
constexpr double kClosesMm = 1e-3;   // a pose that its own angles do not lead back to is none

bool counts_are_set(const std::array<std::int16_t, 3>& count) {
  return count != std::array<std::int16_t, 3>{};
}

}  // namespace

DeviceWire::DeviceWire(Personality personality, const std::array<double, 3>& dock_rad)
    : personality_(personality) {
  switch (personality) {
    case Personality::omni: {
      const OmniParams unit;
      std::ranges::transform(unit.encoder_offset, dock_count_.begin(),
                             [](int count) { return static_cast<std::int16_t>(count); });
      zero_rad_ = dock_rad;
      nmm_per_count_ = unit.torque_nmm_per_count;
      count_end_ = omni::kMotorCountMax;
      for (std::size_t i = 0; i < 3; ++i) {
        rad_per_count_[i] = omni::kEncoderSign[i] * omni::kRadPerCount;
      }
      break;
    }
    case Personality::falcon:
      zero_rad_.fill(falcon::kZeroRad);
      rad_per_count_.fill(falcon::kRadPerCount);
      nmm_per_count_ = FalconParams().torque_nmm_per_count;
      count_end_ = falcon::kMotorCountMax;
      break;
    case Personality::woodenhaptics:
      rad_per_count_ = wooden::kRadPerCount;
      nmm_per_count_ = WoodenParams().torque_nmm_per_count;
      count_end_ = wooden::kMaxMilliamps;
      break;
    case Personality::inverse3:
    case Personality::touch:
    case Personality::omega:
      rad_per_count_.fill(cartesian::figures(personality)->step_um / 1000.0);
      nmm_per_count_ = CartesianParams(personality).torque_nmm_per_count;
      count_end_ = static_cast<int>(force_figures(personality).peak_n * 1000);
      rest_counts_ = std::max(2, 2 * cartesian::figures(personality)->quantum_um /
                                     cartesian::figures(personality)->step_um);
      break;
  }
}

std::optional<ObservedReport> DeviceWire::report(std::span<const std::uint8_t> packet,
                                                 bool may_count_anew) {
  if (personality_ == Personality::woodenhaptics) return wooden_report(packet);
  if (personality_ == Personality::falcon) {
    const auto said = falcon::decode_report(packet);
    if (!said) return std::nullopt;
    return ObservedReport{said->encoder, (said->buttons & falcon::kButtonCentre) != 0,
                          std::ranges::all_of(said->homed, [](bool homed) { return homed; })};
  }
  if (is_cartesian(personality_)) {
    const auto said = decode_cartesian_report(packet);
    if (!said || !is_newest(said->number, may_count_anew)) return std::nullopt;
    ObservedReport told{.parked = said->parked, .homed = said->homed && said->powered};
    for (std::size_t i = 0; i < 3; ++i) {
      const double counts = said->position_um[i] / (rad_per_count_[i] * 1000);
      if (std::abs(counts) > 32'767.4) return std::nullopt;
      told.count[i] = static_cast<std::int16_t>(std::lround(counts));
    }
    return told;
  }
  const auto said = decode_report(packet);
  if (!said || !is_newest(said->counter, may_count_anew)) return std::nullopt;
  return ObservedReport{said->encoder, said->docked, true};
}

bool DeviceWire::is_newest(std::uint32_t number, bool may_count_anew) {
  // Newer by up to 20 ms of an 8 kHz stream is as it says. What is farther ahead may be a wrong
  // bit: up to 2 s ahead it counts from the second packet on that goes on from there. All else is
  // old, until the device may count anew.
  constexpr std::int64_t kNear = 160, kMostAhead = 16'000;
  const auto is_ahead = [&](std::uint32_t of, std::int64_t most) {
    const auto by = static_cast<std::int32_t>(number - of);
    return by > 0 && by <= most;
  };
  if (packet_number_ && !is_ahead(*packet_number_, kNear)) {
    const bool goes_on = far_number_ && is_ahead(*far_number_, kNear);
    far_number_ = number;
    if (!goes_on || !(may_count_anew || is_ahead(*packet_number_, kMostAhead))) return false;
  }
  packet_number_ = number;
  far_number_.reset();
  return true;
}

std::optional<ObservedReport> DeviceWire::wooden_report(std::span<const std::uint8_t> packet) {
  const auto said = wooden::decode_report(packet);
  if (!said) return std::nullopt;
  ObservedReport told;
  bool in_pose = true;
  for (std::size_t i = 0; i < 3; ++i) {
    told.count[i] = said->encoder[i];
    in_pose = in_pose && std::abs(told.count[i] - wooden::kHomeCounts[i]) <= kHomePoseCounts;
  }
  // From the button on until the arm leaves the pose.
  if (said->calibrate) {
    parked_ = true;
  } else if (!in_pose) {
    parked_ = false;
  }
  told.parked = parked_;
  told.homed = encoders_set_;
  return told;
}

std::optional<ObservedCommand> DeviceWire::command(std::span<const std::uint8_t> packet) {
  switch (personality_) {
    case Personality::falcon: {
      const auto asked = falcon::decode_command(packet);
      if (!asked) return std::nullopt;
      return ObservedCommand{asked->motor, counts_are_set(asked->motor)};
    }
    case Personality::woodenhaptics: {
      const auto asked = wooden::decode_command(packet);
      if (!asked) return std::nullopt;
      if (asked->set_encoders) {
        encoders_set_ = true;
        return ObservedCommand{};
      }
      return ObservedCommand{asked->milliamps, counts_are_set(asked->milliamps)};
    }
    case Personality::inverse3:
    case Personality::touch:
    case Personality::omega: {
      const auto asked = decode_cartesian_command(packet);
      if (!asked) return std::nullopt;
      return ObservedCommand{asked->force_mn, asked->force_on};
    }
    case Personality::omni:
      break;
  }
  const auto asked = decode_command(packet);
  if (!asked) return std::nullopt;
  return ObservedCommand{asked->motor, asked->motors_on};
}

std::optional<ArmPose> DeviceWire::pose(const EncoderCounts& count) const {
  std::array<double, 3> q{};
  for (std::size_t i = 0; i < 3; ++i) {
    // From its zero, over the wrap of 16 bits.
    const auto turned =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(int{count[i]} - dock_count_[i]));
    q[i] = zero_rad_[i] + turned * rad_per_count_[i];
  }
  ArmPose pose{{q[0], q[1], q[2]}, {}};
  switch (personality_) {
    case Personality::omni:
      pose.tip_mm = OmniArm().tip_mm(pose.q);
      break;
    case Personality::woodenhaptics:
      pose.tip_mm = WoodenArm().tip_mm(pose.q);
      break;
    case Personality::falcon: {
      pose.tip_mm = FalconArm().tip_mm(pose.q);
      const JointVec<double> back = FalconArm().joints_rad(pose.tip_mm);
      const double off = falcon::kThighMm * norm(back - pose.q);
      if (!(off <= kClosesMm)) return std::nullopt;
      break;
    }
    case Personality::inverse3:
    case Personality::touch:
    case Personality::omega:
      pose.tip_mm = {q[0], q[1], q[2]};
      break;
  }
  return all_finite(pose.tip_mm) ? std::optional(pose) : std::nullopt;
}

double DeviceWire::turned_rad(const EncoderCounts& a, const EncoderCounts& b) const noexcept {
  double most_rad = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto counts = static_cast<std::int16_t>(static_cast<std::uint16_t>(int{b[i]} - a[i]));
    most_rad = std::max(most_rad, std::abs(counts * rad_per_count_[i]));
  }
  return most_rad;
}

DeviceVec<double> DeviceWire::force_n(const ArmPose& pose,
                                      const std::array<std::int16_t, 3>& count) const {
  const JointVec<double> torque_nmm{count[0] * nmm_per_count_[0], count[1] * nmm_per_count_[1],
                                    count[2] * nmm_per_count_[2]};
  switch (personality_) {
    case Personality::falcon:
      return FalconArm().tip_force_n(pose, torque_nmm);
    case Personality::woodenhaptics:
      return WoodenArm().tip_force_n(pose, torque_nmm);
    case Personality::inverse3:
    case Personality::touch:
    case Personality::omega:
      return {torque_nmm.x, torque_nmm.y, torque_nmm.z};
    case Personality::omni:
      break;
  }
  return OmniArm().tip_force_n(pose, torque_nmm);
}

}  // namespace kerf::faults
