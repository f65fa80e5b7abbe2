// SPDX-License-Identifier: Apache-2.0
// Functions of dhd and drd that the stand-in has only by name: a client that binds all names when
// it starts needs each of them. They take any arguments, write nothing, and return an error.

#include "standin/dhd/library.hpp"

using namespace kerf::dhd;  // NOLINT(google-build-using-namespace): the interface is global

namespace {

int expert_only() {
  return fail(library().is_expert ? kNotImplemented : kExpertOnly);
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming,cppcoreguidelines-macro-usage): names of the interface
#define KERF_ABSENT(name)           \
  KERF_STAND_IN_EXPORT int name() { \
    return fail(kNotAvailable);     \
  }
#define KERF_LEFT_OUT(name)         \
  KERF_STAND_IN_EXPORT int name() { \
    return fail(kNotImplemented);   \
  }
#define KERF_EXPERT(name)           \
  KERF_STAND_IN_EXPORT int name() { \
    return expert_only();           \
  }
#define KERF_LEFT_OUT_NUMBER(name)     \
  KERF_STAND_IN_EXPORT double name() { \
    return fail(kNotImplemented);      \
  }

// An omega.3 has no wrist, no gripper and no locks.
KERF_ABSENT(dhdConfigGripperVelocity)
KERF_ABSENT(dhdEnableGripperForce)
KERF_ABSENT(dhdGetGripperAngleDeg)
KERF_ABSENT(dhdGetGripperAngleRad)
KERF_ABSENT(dhdGetGripperAngularVelocityDeg)
KERF_ABSENT(dhdGetGripperAngularVelocityRad)
KERF_ABSENT(dhdGetGripperFingerPos)
KERF_ABSENT(dhdGetGripperGap)
KERF_ABSENT(dhdGetGripperLinearVelocity)
KERF_ABSENT(dhdGetGripperThumbPos)
KERF_ABSENT(dhdResetWrist)
KERF_ABSENT(drdGetGripMoveParam)
KERF_ABSENT(drdGetGripTrackParam)
KERF_ABSENT(drdGetRotMoveParam)
KERF_ABSENT(drdGetRotTrackParam)
KERF_ABSENT(drdLock)
KERF_ABSENT(drdMoveToGrip)
KERF_ABSENT(drdMoveToRot)
KERF_ABSENT(drdSetForceAndWristJointTorquesAndGripperForce)
KERF_ABSENT(drdSetGripMoveParam)
KERF_ABSENT(drdSetGripTrackParam)
KERF_ABSENT(drdSetRotMoveParam)
KERF_ABSENT(drdSetRotTrackParam)
KERF_ABSENT(drdTrackGrip)
KERF_ABSENT(drdTrackRot)

// Regulation by encoders, version texts of components, a simulator of the vendor's own.
KERF_LEFT_OUT(dhdGetComponentVersionStr)
KERF_LEFT_OUT(drdEnableSimulator)
KERF_LEFT_OUT(drdGetEncMoveParam)
KERF_LEFT_OUT(drdGetEncTrackParam)
KERF_LEFT_OUT(drdMoveToAllEnc)
KERF_LEFT_OUT(drdMoveToEnc)
KERF_LEFT_OUT(drdSetEncDGain)
KERF_LEFT_OUT(drdSetEncIGain)
KERF_LEFT_OUT(drdSetEncMoveParam)
KERF_LEFT_OUT(drdSetEncPGain)
KERF_LEFT_OUT(drdSetEncTrackParam)
KERF_LEFT_OUT(drdSetMotRatioMax)
KERF_LEFT_OUT(drdTrackAllEnc)
KERF_LEFT_OUT(drdTrackEnc)
KERF_LEFT_OUT_NUMBER(drdGetEncDGain)
KERF_LEFT_OUT_NUMBER(drdGetEncIGain)
KERF_LEFT_OUT_NUMBER(drdGetEncPGain)
KERF_LEFT_OUT_NUMBER(drdGetMotRatioMax)

// Their arguments are not known.
KERF_LEFT_OUT(dhdGetSDKVersionStr)
KERF_LEFT_OUT(dhdGetSystemCounter)
KERF_LEFT_OUT(dhdGetVersionStr)
KERF_LEFT_OUT(dhdStartThread)

// Motors in counts, ranges, and joints of a wrist.
KERF_EXPERT(dhdControllerSetDevice)
KERF_EXPERT(dhdDeltaForceToMotor)
KERF_EXPERT(dhdDeltaGravityJointTorques)
KERF_EXPERT(dhdDeltaJointTorquesExtrema)
KERF_EXPERT(dhdDeltaMotorToForce)
KERF_EXPERT(dhdGetEncRange)
KERF_EXPERT(dhdGetGripperEncoder)
KERF_EXPERT(dhdGetJointAngleRange)
KERF_EXPERT(dhdGetWristEncoders)
KERF_EXPERT(dhdGetWristJacobian)
KERF_EXPERT(dhdGetWristJointAngles)
KERF_EXPERT(dhdGripperAngleRadToEncoder)
KERF_EXPERT(dhdGripperEncoderToAngleRad)
KERF_EXPERT(dhdGripperEncoderToGap)
KERF_EXPERT(dhdGripperForceToMotor)
KERF_EXPERT(dhdGripperGapToEncoder)
KERF_EXPERT(dhdGripperMotorToForce)
KERF_EXPERT(dhdPreloadMot)
KERF_EXPERT(dhdPreset)
KERF_EXPERT(dhdReadConfigFromFile)
KERF_EXPERT(dhdSetDeltaMotor)
KERF_EXPERT(dhdSetForceAndWristJointTorques)
KERF_EXPERT(dhdSetForceAndWristJointTorquesAndGripperForce)
KERF_EXPERT(dhdSetGripperMotor)
KERF_EXPERT(dhdSetMot)
KERF_EXPERT(dhdSetMotor)
KERF_EXPERT(dhdSetWristJointTorques)
KERF_EXPERT(dhdSetWristMotor)
KERF_EXPERT(dhdWristEncoderToOrientation)
KERF_EXPERT(dhdWristEncodersToJointAngles)
KERF_EXPERT(dhdWristGravityJointTorques)
KERF_EXPERT(dhdWristJointAnglesToEncoders)
KERF_EXPERT(dhdWristJointAnglesToJacobian)
KERF_EXPERT(dhdWristJointTorquesExtrema)
KERF_EXPERT(dhdWristMotorToTorque)
KERF_EXPERT(dhdWristOrientationToEncoder)
KERF_EXPERT(dhdWristTorqueToMotor)
// NOLINTEND(readability-identifier-naming,cppcoreguidelines-macro-usage)
