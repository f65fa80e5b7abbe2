// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <HD/hd.h>

/// Types and numbers of the HD interface, by the header that programs are compiled with: facts of
/// its versions 3.0 to 3.30. Names say the meaning, not the vendor's spelling.
namespace kerf::hd {

using Int = HDint;
using Uint = HDuint;
using Enum = HDenum;
using Handle = HHD;
using Boolean = HDboolean;
using Long = HDlong;
using Ulong = HDulong;
using Callback = HDSchedulerCallback;
using ErrorInfo = HDErrorInfo;
static_assert(sizeof(Int) == 4 && sizeof(Enum) == 4 && sizeof(Long) == 8 &&
              sizeof(ErrorInfo) == 12);

inline constexpr Handle kNoDevice = HD_INVALID_HANDLE;
inline constexpr Handle kFirstDevice = 0;

enum Error : Enum {
  kSuccess = HD_SUCCESS,
  kInvalidEnum = HD_INVALID_ENUM,
  kInvalidValue = HD_INVALID_VALUE,
  kInvalidOperation = HD_INVALID_OPERATION,
  kInvalidType = HD_INVALID_INPUT_TYPE,
  kBadHandle = HD_BAD_HANDLE,
  kWarmMotors = HD_WARM_MOTORS,
  kExceededForce = HD_EXCEEDED_MAX_FORCE,
  kExceededImpulse = HD_EXCEEDED_MAX_FORCE_IMPULSE,
  kExceededVelocity = HD_EXCEEDED_MAX_VELOCITY,
  kForceError = HD_FORCE_ERROR,
  kDeviceFault = HD_DEVICE_FAULT,
  kAlreadyOpen = HD_DEVICE_ALREADY_INITIATED,
  kCommunication = HD_COMM_ERROR,
  kConfiguration = HD_COMM_CONFIG_ERROR,
  kTimer = HD_TIMER_ERROR,
  kIllegalBegin = HD_ILLEGAL_BEGIN,
  kIllegalEnd = HD_ILLEGAL_END,
  kFrameError = HD_FRAME_ERROR,
  kInvalidPriority = HD_INVALID_PRIORITY,
  kSchedulerFull = HD_SCHEDULER_FULL,
  kInvalidLicense = HD_INVALID_LICENSE,
};

enum Parameter : Enum {
  kButtons = HD_CURRENT_BUTTONS,
  kSafetySwitch = HD_CURRENT_SAFETY_SWITCH,
  kInkwellSwitch = HD_CURRENT_INKWELL_SWITCH,
  kEncoders = HD_CURRENT_ENCODER_VALUES,
  kPinch = HD_CURRENT_PINCH_VALUE,
  kLastPinch = HD_LAST_PINCH_VALUE,
  kPosition = HD_CURRENT_POSITION,
  kVelocity = HD_CURRENT_VELOCITY,
  kTransform = HD_CURRENT_TRANSFORM,
  kAngularVelocity = HD_CURRENT_ANGULAR_VELOCITY,
  kJacobian = HD_CURRENT_JACOBIAN,
  kJointAngles = HD_CURRENT_JOINT_ANGLES,
  kGimbalAngles = HD_CURRENT_GIMBAL_ANGLES,
  kLastOffset = HD_LAST_BUTTONS - HD_CURRENT_BUTTONS,  ///< of a reading of the frame before
  kVersion = HD_VERSION,
  kModel = HD_DEVICE_MODEL_TYPE,
  kDriverVersion = HD_DEVICE_DRIVER_VERSION,
  kVendor = HD_DEVICE_VENDOR,
  kSerial = HD_DEVICE_SERIAL_NUMBER,
  kFirmwareVersion = HD_DEVICE_FIRMWARE_VERSION,
  kMaxWorkspace = HD_MAX_WORKSPACE_DIMENSIONS,
  kUsableWorkspace = HD_USABLE_WORKSPACE_DIMENSIONS,
  kTabletopOffset = HD_TABLETOP_OFFSET,
  kInputDof = HD_INPUT_DOF,
  kOutputDof = HD_OUTPUT_DOF,
  kCalibrationStyle = HD_CALIBRATION_STYLE,
  kUpdateRate = HD_UPDATE_RATE,
  kInstantaneousRate = HD_INSTANTANEOUS_UPDATE_RATE,
  kMaxStiffness = HD_NOMINAL_MAX_STIFFNESS,
  kMaxForce = HD_NOMINAL_MAX_FORCE,
  kContinuousForce = HD_NOMINAL_MAX_CONTINUOUS_FORCE,
  kMotorTemperature = HD_MOTOR_TEMPERATURE,
  kVelocityLimit = HD_SOFTWARE_VELOCITY_LIMIT,
  kImpulseLimit = HD_SOFTWARE_FORCE_IMPULSE_LIMIT,
  kRampingRate = HD_FORCE_RAMPING_RATE,
  kMaxDamping = HD_NOMINAL_MAX_DAMPING,
  kMaxTorqueStiffness = HD_NOMINAL_MAX_TORQUE_STIFFNESS,
  kMaxTorqueDamping = HD_NOMINAL_MAX_TORQUE_DAMPING,
  kMaxTorque = HD_NOMINAL_MAX_TORQUE_FORCE,
  kContinuousTorque = HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE,
  kForce = HD_CURRENT_FORCE,
  kTorque = HD_CURRENT_TORQUE,
  kJointReferences = HD_JOINT_ANGLE_REFERENCES,
  kJointTorque = HD_CURRENT_JOINT_TORQUE,
  kGimbalTorque = HD_CURRENT_GIMBAL_TORQUE,
  kMotorDac = HD_CURRENT_MOTOR_DAC_VALUES,
  kLastForce = HD_LAST_FORCE,
  kLastTorque = HD_LAST_TORQUE,
  kLastJointTorque = HD_LAST_JOINT_TORQUE,
  kLastGimbalTorque = HD_LAST_GIMBAL_TORQUE,
  kLastMotorDac = HD_LAST_MOTOR_DAC_VALUES,
  kStatusLight = HD_USER_STATUS_LIGHT,
};

enum Capability : Enum {
  kForceOutput = HD_FORCE_OUTPUT,
  kClampForce = HD_MAX_FORCE_CLAMPING,
  kRampForce = HD_FORCE_RAMPING,
  kForceLimit = HD_SOFTWARE_FORCE_LIMIT,
  kOneFrame = HD_ONE_FRAME_LIMIT,
};

enum Calibration : Enum {
  kCalibrated = HD_CALIBRATION_OK,
  kNeedsUpdate = HD_CALIBRATION_NEEDS_UPDATE,
  kNeedsHand = HD_CALIBRATION_NEEDS_MANUAL_INPUT,
};
inline constexpr Enum kInkwellStyle = HD_CALIBRATION_INKWELL;

inline constexpr Uint kDone = HD_CALLBACK_DONE;  ///< a callback is not called again
inline constexpr Uint kWaitForEnd = HD_WAIT_INFINITE;

}  // namespace kerf::hd
