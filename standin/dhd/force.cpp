// SPDX-License-Identifier: Apache-2.0
// Functions of dhd that give a force, switch the modes and set limits.

#include <cmath>

#include "standin/dhd/library.hpp"

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::dhd;  // NOLINT(google-build-using-namespace): the interface is global

namespace {

int set_force(double x, double y, double z, char id) {
  return with_slot(id, [&](Delta& arm) {
    const int result = arm.set_force(from_dhd(x, y, z));
    if (result != kFailed) return result;
    return fail(std::isfinite(x + y + z) ? kCommunication : kInvalid);
  });
}

int set_mode(Delta::Mode mode, Delta::Cause cause, char id) {
  return with_arm(id, [&](Delta& arm) {
    arm.set_mode(mode, cause);
    return arm.apply() < 0 ? fail(kCommunication) : kOk;
  });
}

int keep(double Delta::*member, double value, char id) {
  if (std::isnan(value)) return fail(kInvalid);
  return with_arm(id, [&](Delta& arm) { return arm.*member = value, kOk; });
}
double kept(double Delta::*member, char id) {
  double value = kFailed;
  static_cast<void>(with_arm(id, [&](Delta& arm) { return value = arm.*member, kOk; }));
  return value;
}

/// Changes of the firmware's safety are for experts.
template <class Use>
int with_expert(char id, const Use& use) {
  return library().is_expert ? with_arm(id, use) : fail(kExpertOnly);
}

}  // namespace

KERF_STAND_IN_EXPORT int dhdSetForce(double x, double y, double z, char id) {
  return set_force(x, y, z, id);
}
KERF_STAND_IN_EXPORT int dhdSetForceAndTorque(double x, double y, double z, double /*tx*/,
                                              double /*ty*/, double /*tz*/, char id) {
  return set_force(x, y, z, id);
}
KERF_STAND_IN_EXPORT int dhdSetForceAndGripperForce(double x, double y, double z, double /*grip*/,
                                                    char id) {
  return set_force(x, y, z, id);
}
KERF_STAND_IN_EXPORT int dhdSetForceAndTorqueAndGripperForce(double x, double y, double z,
                                                             double /*tx*/, double /*ty*/,
                                                             double /*tz*/, double /*grip*/,
                                                             char id) {
  return set_force(x, y, z, id);
}
KERF_STAND_IN_EXPORT int dhdGetForce(double* x, double* y, double* z, char id) {
  return with_arm(id, [&](Delta& arm) { return give(to_dhd(arm.force_n()), x, y, z), kOk; });
}
KERF_STAND_IN_EXPORT int dhdGetForceAndTorque(double* x, double* y, double* z, double* tx,
                                              double* ty, double* tz, char id) {
  const int result = dhdGetForce(x, y, z, id);
  if (result >= 0) give({}, tx, ty, tz);
  return result;
}
KERF_STAND_IN_EXPORT int dhdGetForceAndTorqueAndGripperForce(double* x, double* y, double* z,
                                                             double* tx, double* ty, double* tz,
                                                             double* grip, char id) {
  const int result = dhdGetForceAndTorque(x, y, z, tx, ty, tz, id);
  if (result >= 0) give(grip, 0.0);
  return result;
}

KERF_STAND_IN_EXPORT int dhdEnableForce(unsigned char on, char id) {
  return on != 0 ? set_mode(Delta::Mode::force, Delta::Cause::none, id)
                 : set_mode(Delta::Mode::brake, Delta::Cause::software, id);
}
KERF_STAND_IN_EXPORT int dhdStop(char id) {
  return set_mode(Delta::Mode::brake, Delta::Cause::software, id);
}
KERF_STAND_IN_EXPORT int dhdSetBrakes(int on, char id) {
  return set_mode(on != 0 ? Delta::Mode::brake : Delta::Mode::idle, Delta::Cause::software, id);
}
KERF_STAND_IN_EXPORT int dhdSetBrk(unsigned char /*mask*/, char id) {
  return with_expert(id, [](Delta&) { return kOk; });
}
KERF_STAND_IN_EXPORT int dhdReset(char id) {
  return set_mode(Delta::Mode::idle, Delta::Cause::none, id);
}
/// The emulated device is calibrated at once.
KERF_STAND_IN_EXPORT int dhdWaitForReset(int /*ms*/, char id) {
  return with_arm(id, [](Delta& arm) { return arm.is_initialised = true, kOk; });
}

KERF_STAND_IN_EXPORT int dhdSetMaxForce(double limit_n, char id) {
  return keep(&Delta::most_n, limit_n, id);
}
KERF_STAND_IN_EXPORT double dhdGetMaxForce(char id) {
  return kept(&Delta::most_n, id);
}
KERF_STAND_IN_EXPORT int dhdSetMaxTorque(double limit, char id) {
  return keep(&Delta::most_torque, limit, id);
}
KERF_STAND_IN_EXPORT double dhdGetMaxTorque(char id) {
  return kept(&Delta::most_torque, id);
}
KERF_STAND_IN_EXPORT int dhdSetMaxGripperForce(double limit_n, char id) {
  return keep(&Delta::most_gripper_n, limit_n, id);
}
KERF_STAND_IN_EXPORT double dhdGetMaxGripperForce(char id) {
  return kept(&Delta::most_gripper_n, id);
}

// Weight: kept, and without effect, since the emulated weight counts as balanced.
KERF_STAND_IN_EXPORT int dhdSetGravityCompensation(int on, char id) {
  return with_arm(id, [&](Delta& arm) { return arm.compensates_gravity = on != 0, kOk; });
}
KERF_STAND_IN_EXPORT int dhdSetStandardGravity(double gravity, char id) {
  return keep(&Delta::gravity, gravity, id);
}
KERF_STAND_IN_EXPORT int dhdSetEffectorMass(double kilograms, char id) {
  return keep(&Delta::effector_kg, kilograms, id);
}
KERF_STAND_IN_EXPORT int dhdGetEffectorMass(double* kilograms, char id) {
  return with_arm(id, [&](Delta& arm) { return give(kilograms, arm.effector_kg), kOk; });
}

KERF_STAND_IN_EXPORT double dhdGetComFreq(char id) {
  double khz = 0;
  static_cast<void>(with_arm(id, [&](Delta& arm) { return khz = arm.command_khz(), kOk; }));
  return khz;
}
KERF_STAND_IN_EXPORT int dhdSetOutput(unsigned /*mask*/, char id) {
  return with_arm(id, [](Delta&) { return kOk; });
}
KERF_STAND_IN_EXPORT int dhdSetVibration(double /*frequency*/, double /*amplitude*/,
                                         int /*profile*/, char id) {
  return with_arm(id, [](Delta&) { return fail(kNotAvailable); });
}

KERF_STAND_IN_EXPORT int dhdSetTimeGuard(int us, char id) {
  if (us < -1) return fail(kInvalid);
  return with_expert(id, [&](Delta& arm) {
    arm.guard_us = us < 0 ? 0 : us;  // -1 is the factory value, which is not known
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdSetVelocityThreshold(unsigned metres_per_second, char id) {
  return with_expert(id, [&](Delta& arm) {
    return arm.velocity_limit_m_s = static_cast<double>(metres_per_second), kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetVelocityThreshold(unsigned* metres_per_second, char id) {
  return with_expert(id, [&](Delta& arm) {
    give(metres_per_second, static_cast<unsigned>(arm.velocity_limit_m_s));
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdSetWatchdog(unsigned char steps, char id) {
  constexpr double kStepS = 125e-6;
  return with_expert(id, [&](Delta& arm) {
    arm.watchdog_s = steps * kStepS;
    if (steps > 0) library().keep_ticking();
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetWatchdog(unsigned char* steps, char id) {
  return with_expert(id, [&](Delta& arm) {
    give(steps, static_cast<unsigned char>(std::lround(arm.watchdog_s / 125e-6)));
    return kOk;
  });
}
// NOLINTEND(readability-identifier-naming)
