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

/// Counts, angles and motors of a device. Not in the namespace without a name: g++ 14.2 crashes at
/// a pointer to a function that returns such a type if another file includes this one (unity
/// build).
struct WireUnits {
  std::array<double, 3> zero_rad{}, rad_per_count{}, nmm_per_count{};
  int count_end = 0;
  EncoderCounts dock_count{};
};

namespace {

constexpr int kHomePoseCounts = 40;  // WoodenHaptics: the home pose, as a hand holds it
constexpr double kClosesMm = 1e-3;   // a pose that its own angles do not lead back to is none

bool counts_are_set(const std::array<std::int16_t, 3>& count) {
  return count != std::array<std::int16_t, 3>{};
}

WireUnits omni_units(Personality, const std::array<double, 3>& dock_rad) {
  const OmniParams unit;
  WireUnits units{dock_rad, {}, unit.torque_nmm_per_count, omni::kMotorCountMax};
  std::ranges::transform(unit.encoder_offset, units.dock_count.begin(),
                         [](int count) { return static_cast<std::int16_t>(count); });
  for (std::size_t i = 0; i < 3; ++i) {
    units.rad_per_count[i] = omni::kEncoderSign[i] * omni::kRadPerCount;
  }
  return units;
}

WireUnits falcon_units(Personality, const std::array<double, 3>&) {
  WireUnits units{{}, {}, FalconParams().torque_nmm_per_count, falcon::kMotorCountMax};
  units.zero_rad.fill(falcon::kZeroRad);
  units.rad_per_count.fill(falcon::kRadPerCount);
  return units;
}

WireUnits wooden_units(Personality, const std::array<double, 3>&) {
  return {{}, wooden::kRadPerCount, WoodenParams().torque_nmm_per_count, wooden::kMaxMilliamps};
}

WireUnits cartesian_units(Personality personality, const std::array<double, 3>&) {
  WireUnits units{{},
                  {},
                  CartesianParams(personality).torque_nmm_per_count,
                  static_cast<int>(force_figures(personality).peak_n * 1000)};
  units.rad_per_count.fill(cartesian::figures(personality)->step_um / 1000.0);
  return units;
}

template <class Arm>
std::optional<DeviceVec<double>> tip_of(const JointVec<double>& q) {
  return Arm().tip_mm(q);
}

/// A pose that its own angles do not lead back to is none: the legs do not meet.
std::optional<DeviceVec<double>> delta_tip_of(const JointVec<double>& q) {
  const DeviceVec<double> tip_mm = FalconArm().tip_mm(q);
  const double off = falcon::kThighMm * norm(FalconArm().joints_rad(tip_mm) - q);
  return off <= kClosesMm ? std::optional(tip_mm) : std::nullopt;
}

std::optional<DeviceVec<double>> axes_tip_of(const JointVec<double>& q) {
  return DeviceVec<double>{q.x, q.y, q.z};
}

template <class Arm>
DeviceVec<double> force_of(const ArmPose& pose, const JointVec<double>& torque_nmm) {
  return Arm().tip_force_n(pose, torque_nmm);
}

DeviceVec<double> axes_force_of(const ArmPose&, const JointVec<double>& force_n) {
  return {force_n.x, force_n.y, force_n.z};
}

}  // namespace

struct DeviceWire::Kind {
  Personality personality;
  WireUnits (*units)(Personality, const std::array<double, 3>& dock_rad);
  std::optional<ObservedReport> (DeviceWire::*report)(Packet, bool may_count_anew);
  std::optional<ObservedCommand> (DeviceWire::*command)(Packet);
  std::optional<DeviceVec<double>> (*tip_mm)(const JointVec<double>&);
  DeviceVec<double> (*force_n)(const ArmPose&, const JointVec<double>& torque_nmm);
};

constexpr std::array<DeviceWire::Kind, kDeviceKinds.size()> DeviceWire::kinds() noexcept {
  using W = DeviceWire;
  return {{{Personality::omni, omni_units, &W::omni_report, &W::omni_command, tip_of<OmniArm>,
            force_of<OmniArm>},
           {Personality::falcon, falcon_units, &W::falcon_report, &W::falcon_command, delta_tip_of,
            force_of<FalconArm>},
           {Personality::woodenhaptics, wooden_units, &W::wooden_report, &W::wooden_command,
            tip_of<WoodenArm>, force_of<WoodenArm>},
           {Personality::inverse3, cartesian_units, &W::cartesian_report, &W::cartesian_command,
            axes_tip_of, axes_force_of},
           {Personality::touch, cartesian_units, &W::cartesian_report, &W::cartesian_command,
            axes_tip_of, axes_force_of},
           {Personality::omega, cartesian_units, &W::cartesian_report, &W::cartesian_command,
            axes_tip_of, axes_force_of}}};
}

DeviceWire::DeviceWire(Personality personality, const std::array<double, 3>& dock_rad)
    : device_(kerf::kind_of(personality)), kind_(kind_of(personality)) {
  const WireUnits units = kind_.units(personality, dock_rad);
  zero_rad_ = units.zero_rad;
  rad_per_count_ = units.rad_per_count;
  nmm_per_count_ = units.nmm_per_count;
  count_end_ = units.count_end;
  dock_count_ = units.dock_count;
  if (const auto& axes = device_.axes) {
    rest_counts_ = std::max(2, 2 * axes->quantum_um / axes->step_um);
  }
}

const DeviceWire::Kind& DeviceWire::kind_of(Personality personality) noexcept {
  static constexpr std::array kKinds = kinds();
  static_assert(covers_devices(kKinds));
  return row_of(kKinds, personality);
}

std::optional<ObservedReport> DeviceWire::report(Packet packet, bool may_count_anew) {
  return (this->*kind_.report)(packet, may_count_anew);
}

std::optional<ObservedReport> DeviceWire::omni_report(Packet packet, bool may_count_anew) {
  const auto said = decode_report(packet);
  if (!said || !is_newest(said->counter, may_count_anew)) return std::nullopt;
  return ObservedReport{said->encoder, said->docked, true};
}

std::optional<ObservedReport> DeviceWire::falcon_report(Packet packet, bool) {
  const auto said = falcon::decode_report(packet);
  if (!said) return std::nullopt;
  return ObservedReport{said->encoder, (said->buttons & falcon::kButtonCentre) != 0,
                        std::ranges::all_of(said->homed, [](bool homed) { return homed; })};
}

std::optional<ObservedReport> DeviceWire::cartesian_report(Packet packet, bool may_count_anew) {
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

std::optional<ObservedReport> DeviceWire::wooden_report(Packet packet, bool) {
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

std::optional<ObservedCommand> DeviceWire::command(Packet packet) {
  return (this->*kind_.command)(packet);
}

std::optional<ObservedCommand> DeviceWire::omni_command(Packet packet) {
  const auto asked = decode_command(packet);
  if (!asked) return std::nullopt;
  return ObservedCommand{asked->motor, asked->motors_on};
}

std::optional<ObservedCommand> DeviceWire::falcon_command(Packet packet) {
  const auto asked = falcon::decode_command(packet);
  if (!asked) return std::nullopt;
  return ObservedCommand{asked->motor, counts_are_set(asked->motor)};
}

std::optional<ObservedCommand> DeviceWire::wooden_command(Packet packet) {
  const auto asked = wooden::decode_command(packet);
  if (!asked) return std::nullopt;
  if (asked->set_encoders) {
    encoders_set_ = true;
    return ObservedCommand{};
  }
  return ObservedCommand{asked->milliamps, counts_are_set(asked->milliamps)};
}

std::optional<ObservedCommand> DeviceWire::cartesian_command(Packet packet) {
  const auto asked = decode_cartesian_command(packet);
  if (!asked) return std::nullopt;
  return ObservedCommand{asked->force_mn, asked->force_on};
}

std::optional<ArmPose> DeviceWire::pose(const EncoderCounts& count) const {
  std::array<double, 3> q{};
  for (std::size_t i = 0; i < 3; ++i) {
    // From its zero, over the wrap of 16 bits.
    const auto turned =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(int{count[i]} - dock_count_[i]));
    q[i] = zero_rad_[i] + turned * rad_per_count_[i];
  }
  const JointVec<double> joints{q[0], q[1], q[2]};
  const auto tip_mm = kind_.tip_mm(joints);
  if (!tip_mm || !all_finite(*tip_mm)) return std::nullopt;
  return ArmPose{joints, *tip_mm};
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
  return kind_.force_n(pose, {count[0] * nmm_per_count_[0], count[1] * nmm_per_count_[1],
                              count[2] * nmm_per_count_[2]});
}

}  // namespace kerf::faults
