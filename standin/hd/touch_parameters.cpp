// SPDX-License-Identifier: Apache-2.0
#include <initializer_list>

#include "shared/wire/cartesian.hpp"
#include "shared/wire/personality.hpp"
#include "standin/hd/touch.hpp"

// The parameters of a Touch: readings, figures, texts, and what can be set.

namespace kerf::hd {
namespace {

constexpr unsigned kReal = kFloat | kDouble;
constexpr unsigned kWhole = kInt | kLong;

[[nodiscard]] Values values(unsigned types, std::initializer_list<double> list) noexcept {
  Values made{types, list.size(), {}};
  std::size_t i = 0;
  for (const double value : list) made.value[i++] = value;
  return made;
}
[[nodiscard]] Values values(DeviceVec<double> v) noexcept {
  return values(kReal, {v.x, v.y, v.z});
}
[[nodiscard]] Values values(const Angles& a) noexcept {
  return values(kReal, {a[0], a[1], a[2]});
}
[[nodiscard]] Values box(const std::array<double, 3>& low, const std::array<double, 3>& high) {
  return values(kReal, {low[0], low[1], low[2], high[0], high[1], high[2]});
}

/// Parameters that the vendor's library has and the stand-in has not: no document says what they
/// hold, or a Touch has no part for them.
[[nodiscard]] bool is_left_out(Enum name) noexcept {
  switch (name) {
    case kEncoders:
    case kEncoders + kLastOffset:
    case kPinch:
    case kLastPinch:
    case kJacobian:
    case kJacobian + kLastOffset:
    case kMotorDac:
    case kLastMotorDac:
    case kSafetySwitch:
    case kJointReferences:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::optional<Values> Touch::reading(Enum name, const Readings& from) const noexcept {
  switch (name) {
    case kButtons:
      return values(kWhole | kReal, {static_cast<double>(from.buttons)});
    case kPosition:
      return values(from.pose.tip_mm);
    case kVelocity:
      return values(from.velocity);
    case kAngularVelocity:
      return values(from.angular_velocity);
    case kJointAngles:
      return values(from.joints);
    case kGimbalAngles:
      return values(from.gimbal);
    case kTransform:
      return Values{kReal, from.transform.size(), from.transform};
    default:
      return std::nullopt;
  }
}

std::optional<Values> Touch::figure(Enum name) const noexcept {
  constexpr unsigned kAny = kReal | kWhole;  // clients read these as doubles and as ints
  constexpr auto kFigures = *cartesian::figures(Personality::touch);
  constexpr ForceFigures kForces = force_figures(Personality::touch);
  switch (name) {
    case kInkwellSwitch:
      return values(kBool, {arm_.pose().parked ? 0.0 : 1.0});
    case kMaxWorkspace:
      return box(kFigures.low_mm, kFigures.high_mm);
    case kUsableWorkspace:
      return box({-80, -60, -35}, {80, 60, 35});  // 160 x 120 x 70: data sheet
    case kTabletopOffset:
      return values(kAny, {-kFigures.rest_mm[1]});  // our own: its inkwell
    case kFirmwareVersion:
      return values(kAny, {1});
    case kInputDof:
      return values(kWhole, {6});
    case kOutputDof:
      return values(kWhole, {3});
    case kCalibrationStyle:
      return values(kWhole, {double{kInkwellStyle}});
    case kUpdateRate:
    case kInstantaneousRate:
      return values(kAny, {static_cast<double>(rate_hz_)});
    case kMaxStiffness:
      return values(kReal, {0.5});  // of the vendor's configuration file
    case kMaxForce:
      return values(kReal, {kForces.peak_n});
    case kContinuousForce:
      return values(kReal, {kForces.continuous_n});
    case kMaxDamping:
      return values(kReal, {0.003});  // as kMaxStiffness
    case kMotorTemperature:
      return values(kReal, {0});  // the emulated motors stay cold
    case kVelocityLimit:
      return values(kReal, {velocity_limit_});
    case kImpulseLimit:
      return values(kReal, {impulse_limit_n_});
    case kRampingRate:
      return values(kReal, {ramping_rate_});
    case kForce: {
      const DeviceVec<double> set_n = in_frame_ ? wanted_.force_n : last_force_n_;
      return values(set_n);
    }
    case kLastForce:
      return values(last_force_n_);
    case kTorque:
    case kLastTorque:
    case kGimbalTorque:
    case kLastGimbalTorque:
    case kJointTorque:
    case kLastJointTorque:
      return values(DeviceVec<double>{});  // none that the stand-in gives
    default:
      return std::nullopt;
  }
}

std::optional<Values> Touch::read(Enum name, unsigned type) noexcept {
  std::optional<Values> found = figure(name);
  if (!found) found = reading(name, now_);
  if (!found && name >= kLastOffset) found = reading(name - kLastOffset, before_);
  if (!found) {
    push(is_left_out(name) ? kInvalidOperation : kInvalidEnum);
  } else if ((found->types & type) == 0) {
    push(kInvalidType);
    found.reset();
  }
  return found;
}

std::size_t Touch::writes(Enum name, unsigned type) noexcept {
  unsigned types = kReal;
  std::size_t count = 1;
  switch (name) {
    case kForce:
    case kTorque:
    case kJointTorque:
    case kGimbalTorque:
      count = 3;
      if (!in_frame_) {
        ledger_.add(standin::Row::set_outside_frame);
        push(kFrameError);
        return 0;
      }
      break;
    case kMotorDac:
      types = kLong;
      break;
    case kVelocityLimit:
    case kImpulseLimit:
    case kRampingRate:
      break;
    case kStatusLight:
      types = kInt;
      break;
    default:
      push(kInvalidEnum);
      return 0;
  }
  if ((types & type) != 0) return count;
  push(kInvalidType);
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
