// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Types and numbers of the HD interface that programs are compiled with: facts of its versions 3.0
/// to 3.30, declared in our own words. Names say the meaning, not the vendor's spelling.
namespace kerf::hd {

using Int = std::int32_t;
using Uint = std::uint32_t;
using Enum = std::uint32_t;
using Handle = std::uint32_t;
using Boolean = std::uint8_t;
using Long = long;            // NOLINT(google-runtime-int): the interface says long
using Ulong = unsigned long;  // NOLINT(google-runtime-int)
using Callback = Uint (*)(void*);

/// Returned by value: 12 bytes, as a struct of C.
struct ErrorInfo {
  Enum code;
  int internal_code;
  Handle device;
};
static_assert(sizeof(ErrorInfo) == 12);

inline constexpr Handle kNoDevice = 0xFFFFFFFF;
inline constexpr Handle kFirstDevice = 0;

enum Error : Enum {
  kSuccess = 0,
  kInvalidEnum = 0x100,
  kInvalidValue = 0x101,
  kInvalidOperation = 0x102,
  kInvalidType = 0x103,
  kBadHandle = 0x104,
  kWarmMotors = 0x200,
  kExceededForce = 0x201,
  kExceededImpulse = 0x202,
  kExceededVelocity = 0x203,
  kForceError = 0x204,
  kDeviceFault = 0x300,
  kAlreadyOpen = 0x301,
  kCommunication = 0x302,
  kConfiguration = 0x303,
  kTimer = 0x304,
  kIllegalBegin = 0x400,
  kIllegalEnd = 0x401,
  kFrameError = 0x402,
  kInvalidPriority = 0x500,
  kSchedulerFull = 0x501,
  kInvalidLicense = 0x600,
};

enum Parameter : Enum {
  kButtons = 0x2000,
  kSafetySwitch = 0x2001,
  kInkwellSwitch = 0x2002,
  kEncoders = 0x2010,
  kPinch = 0x2011,
  kLastPinch = 0x2012,
  kPosition = 0x2050,
  kVelocity = 0x2051,
  kTransform = 0x2052,
  kAngularVelocity = 0x2053,
  kJacobian = 0x2054,
  kJointAngles = 0x2100,
  kGimbalAngles = 0x2150,
  kLastOffset = 0x200,  ///< of a reading of the frame before
  kVersion = 0x2500,
  kModel = 0x2501,
  kDriverVersion = 0x2502,
  kVendor = 0x2503,
  kSerial = 0x2504,
  kFirmwareVersion = 0x2505,
  kMaxWorkspace = 0x2550,
  kUsableWorkspace = 0x2551,
  kTabletopOffset = 0x2552,
  kInputDof = 0x2553,
  kOutputDof = 0x2554,
  kCalibrationStyle = 0x2555,
  kUpdateRate = 0x2600,
  kInstantaneousRate = 0x2601,
  kMaxStiffness = 0x2602,
  kMaxForce = 0x2603,
  kContinuousForce = 0x2604,
  kMotorTemperature = 0x2605,
  kVelocityLimit = 0x2606,
  kImpulseLimit = 0x2607,
  kRampingRate = 0x2608,
  kMaxDamping = 0x2609,
  kMaxTorqueStiffness = 0x2620,
  kMaxTorqueDamping = 0x2621,
  kMaxTorque = 0x2622,
  kContinuousTorque = 0x2623,
  kForce = 0x2700,
  kTorque = 0x2701,
  kJointReferences = 0x2702,
  kJointTorque = 0x2703,
  kGimbalTorque = 0x2704,
  kMotorDac = 0x2750,
  kLastForce = 0x2800,
  kLastTorque = 0x2801,
  kLastJointTorque = 0x2802,
  kLastGimbalTorque = 0x2803,
  kLastMotorDac = 0x2850,
  kStatusLight = 0x2900,
};

enum Capability : Enum {
  kForceOutput = 0x4000,
  kClampForce = 0x4001,
  kRampForce = 0x4002,
  kForceLimit = 0x4003,
  kOneFrame = 0x4004,
};

enum Calibration : Enum { kCalibrated = 0x5000, kNeedsUpdate = 0x5001, kNeedsHand = 0x5002 };
inline constexpr Enum kInkwellStyle = 4;

inline constexpr Uint kDone = 0;  ///< a callback is not called again
inline constexpr Uint kWaitForEnd = 1;

}  // namespace kerf::hd
