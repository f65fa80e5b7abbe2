// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <initializer_list>
#include <span>

#include "shared/wire/cartesian.hpp"
#include "shared/wire/personality.hpp"
#include "standin/hd/touch.hpp"

// The parameters of a Touch: readings, figures, texts, and what can be set.

namespace kerf::hd {
namespace {

constexpr unsigned kReal = kFloat | kDouble;
constexpr unsigned kWhole = kInt | kLong;
constexpr unsigned kAny = kReal | kWhole;  // clients read these as doubles and as ints
constexpr auto kFigures = *cartesian::figures(standin::kHd.personality);
constexpr ForceFigures kForces = force_figures(standin::kHd.personality);

using Out = std::span<double>;

void give(Out out, std::initializer_list<double> list) noexcept {
  std::copy(list.begin(), list.end(), out.begin());
}
void give(Out out, DeviceVec<double> v) noexcept {
  give(out, {v.x, v.y, v.z});
}
template <std::size_t N>
void give(Out out, const std::array<double, N>& all) noexcept {
  std::copy(all.begin(), all.end(), out.begin());
}

/// Belongs to the force of a frame.
bool is_force(Enum name) noexcept {
  return name == kForce || name == kTorque || name == kJointTorque || name == kGimbalTorque;
}

}  // namespace

/// A parameter: what it holds, how many numbers, and who may read and write it.
struct Touch::Parameter {
  Enum name;
  std::size_t count;  ///< numbers of a read and of a write; 0: the stand-in has none
  unsigned reads, writes;
  bool has_last;  ///< at kLastOffset: of the frame before
  void (*read)(const Touch& touch, const Readings& from, Out out);
};

/// All of the interface but its texts. Without a `read`, no document says what they hold, or a
/// Touch has no part for them.
struct Touch::Parameters {
  using T = const Touch&;
  using R = const Readings&;
  static constexpr auto kNothing = [](T, R, Out out) { give(out, DeviceVec<double>{}); };
  static constexpr std::array kAll{
      // of a frame
      Parameter{kButtons, 1, kAny, 0, true,
                [](T, R from, Out out) { give(out, {static_cast<double>(from.buttons)}); }},
      Parameter{kInkwellSwitch, 1, kBool, 0, true,
                [](T, R from, Out out) { give(out, {from.pose.parked ? 0.0 : 1.0}); }},
      Parameter{kSafetySwitch, 0, kBool, 0, true, nullptr},
      Parameter{kEncoders, 6, kLong, 0, true,
                [](T, R from, Out out) { give(out, encoder_counts(from.joints, from.gimbal)); }},
      Parameter{kPinch, 0, kReal, 0, false, nullptr},
      Parameter{kLastPinch, 0, kReal, 0, false, nullptr},
      Parameter{kPosition, 3, kReal, 0, true,
                [](T, R from, Out out) { give(out, from.pose.tip_mm); }},
      Parameter{kVelocity, 3, kReal, 0, true, [](T, R from, Out out) { give(out, from.velocity); }},
      Parameter{kTransform, 16, kReal, 0, true,
                [](T, R from, Out out) { give(out, from.transform); }},
      Parameter{kAngularVelocity, 3, kReal, 0, true,
                [](T, R from, Out out) { give(out, from.angular_velocity); }},
      Parameter{kJacobian, 0, kReal, 0, true, nullptr},
      Parameter{kJointAngles, 3, kReal, 0, true,
                [](T, R from, Out out) { give(out, from.joints); }},
      Parameter{kGimbalAngles, 3, kReal, 0, true,
                [](T, R from, Out out) { give(out, from.gimbal); }},
      // what the program sets
      Parameter{kForce, 3, kReal, kReal, false,
                [](T touch, R, Out out) {
                  give(out, touch.in_frame_ ? touch.wanted_.force_n : touch.last_force_n_);
                }},
      Parameter{kLastForce, 3, kReal, 0, false,
                [](T touch, R, Out out) { give(out, touch.last_force_n_); }},
      Parameter{kTorque, 3, kReal, kReal, false, kNothing},
      Parameter{kJointTorque, 3, kReal, kReal, false, kNothing},
      Parameter{kGimbalTorque, 3, kReal, kReal, false, kNothing},
      Parameter{kLastTorque, 3, kReal, 0, false, kNothing},
      Parameter{kLastJointTorque, 3, kReal, 0, false, kNothing},
      Parameter{kLastGimbalTorque, 3, kReal, 0, false, kNothing},
      Parameter{kMotorDac, 3, kLong, kLong, false, nullptr},
      Parameter{kLastMotorDac, 0, kLong, 0, false, nullptr},
      Parameter{kStatusLight, 1, 0, kInt, false, nullptr},
      Parameter{kVelocityLimit, 1, kReal, kReal, false,
                [](T touch, R, Out out) { give(out, {touch.velocity_limit_}); }},
      Parameter{kImpulseLimit, 1, kReal, kReal, false,
                [](T touch, R, Out out) { give(out, {touch.impulse_limit_n_}); }},
      Parameter{kRampingRate, 1, kReal, kReal, false,
                [](T touch, R, Out out) { give(out, {touch.ramping_rate_}); }},
      // of the device
      Parameter{kFirmwareVersion, 1, kAny, 0, false, [](T, R, Out out) { give(out, {1}); }},
      Parameter{kMaxWorkspace, 6, kReal, 0, false,
                [](T, R, Out out) {
                  give(out.first(3), kFigures.low_mm);
                  give(out.last(3), kFigures.high_mm);
                }},
      Parameter{kUsableWorkspace, 6, kReal, 0, false,  // 160 x 120 x 70: data sheet
                [](T, R, Out out) {
                  give(out, {-80, -60, -35, 80, 60, 35});
                }},
      Parameter{kTabletopOffset, 1, kAny, 0, false,  // our own: its inkwell
                [](T, R, Out out) { give(out, {-kFigures.rest_mm[1]}); }},
      Parameter{kInputDof, 1, kWhole, 0, false, [](T, R, Out out) { give(out, {6}); }},
      Parameter{kOutputDof, 1, kWhole, 0, false, [](T, R, Out out) { give(out, {kMotors}); }},
      Parameter{kCalibrationStyle, 1, kWhole, 0, false,
                [](T, R, Out out) { give(out, {kInkwellStyle}); }},
      Parameter{kUpdateRate, 1, kAny, 0, false,
                [](T touch, R, Out out) { give(out, {static_cast<double>(touch.rate_hz_)}); }},
      Parameter{kInstantaneousRate, 1, kAny, 0, false,
                [](T touch, R, Out out) { give(out, {static_cast<double>(touch.rate_hz_)}); }},
      Parameter{kMaxStiffness, 1, kReal, 0, false,  // of the vendor's configuration file
                [](T, R, Out out) { give(out, {0.5}); }},
      Parameter{kMaxDamping, 1, kReal, 0, false,  // of the same file
                [](T, R, Out out) { give(out, {0.003}); }},
      Parameter{kMaxForce, 1, kReal, 0, false, [](T, R, Out out) { give(out, {kForces.peak_n}); }},
      Parameter{kContinuousForce, 1, kReal, 0, false,
                [](T, R, Out out) { give(out, {kForces.continuous_n}); }},
      Parameter{kMotorTemperature, kMotors, kReal, 0, false,
                [](T touch, R, Out out) { give(out, touch.heat_.temperatures()); }},
      Parameter{kMaxTorqueStiffness, 0, kReal, 0, false, nullptr},
      Parameter{kMaxTorqueDamping, 0, kReal, 0, false, nullptr},
      Parameter{kMaxTorque, 0, kReal, 0, false, nullptr},
      Parameter{kContinuousTorque, 0, kReal, 0, false, nullptr},
      Parameter{kJointReferences, 0, kReal, 0, false, nullptr},
  };
};

const Touch::Parameter* Touch::parameter(Enum name) noexcept {
  const auto found = std::ranges::find_if(Parameters::kAll, [&](const Parameter& one) {
    return one.name == name || (one.has_last && one.name + kLastOffset == name);
  });
  return found == Parameters::kAll.end() ? nullptr : &*found;
}

std::optional<Values> Touch::read(Enum name, unsigned type) noexcept {
  const Parameter* const found = parameter(name);
  if (found == nullptr || found->reads == 0) {
    push(kInvalidEnum);
  } else if (found->read == nullptr) {
    push(kInvalidOperation);
  } else if ((found->reads & type) == 0) {
    push(kInvalidType);
  } else {
    Values values{.count = found->count, .value = {}};
    // The switch of the inkwell is read outside a frame, too.
    const Readings newest = name == kInkwellSwitch ? sampled() : Readings{};
    const Readings& from = name != found->name ? before_ : name == kInkwellSwitch ? newest : now_;
    found->read(*this, from, std::span(values.value).first(found->count));
    return values;
  }
  return std::nullopt;
}

std::size_t Touch::writes(Enum name, unsigned type) noexcept {
  const Parameter* const found = parameter(name);
  if (found == nullptr || found->name != name || found->writes == 0) {
    push(kInvalidEnum);
  } else if (is_force(name) && !in_frame_) {
    ledger_.add(standin::Row::set_outside_frame);
    push(kFrameError);
  } else if ((found->writes & type) == 0) {
    push(kInvalidType);
  } else {
    return found->count;
  }
  return 0;
}

void Touch::write(Enum name, const std::array<double, 16>& value) noexcept {
  switch (name) {
    case kForce:
      wanted_.force_n = {value[0], value[1], value[2]};
      wanted_.has_force = true;
      break;
    case kJointTorque:
      wanted_.joint_torque_mnm = Angles{value[0], value[1], value[2]};
      break;
    case kMotorDac:
      wanted_.has_dac = true;
      push(kInvalidOperation);  // what a count gives is not known
      break;
    case kVelocityLimit:
      if (value[0] > 0) velocity_limit_ = value[0];
      break;
    case kImpulseLimit:
      if (value[0] > 0) impulse_limit_n_ = value[0];
      break;
    case kRampingRate:
      if (value[0] >= 0) ramping_rate_ = value[0];
      break;
    default:
      break;  // torques of a stylus without motors, the light
  }
}

const char* Touch::text(Enum name) noexcept {
  switch (name) {
    case kModel:
      return "Touch";
    case kVendor:
      return "kerf stand-in";
    case kDriverVersion:
      return "kerf " KERF_VERSION;
    case kSerial:
      return serial_.c_str();
    default:
      break;
  }
  push(kInvalidEnum);
  return nullptr;
}

}  // namespace kerf::hd
