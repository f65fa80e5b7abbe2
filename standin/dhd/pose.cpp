// SPDX-License-Identifier: Apache-2.0
// Functions of dhd that read the pose, the velocity, the buttons and the status.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "standin/dhd/library.hpp"

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::dhd;  // NOLINT(google-build-using-namespace): the interface is global

namespace {

std::array<double, 3> position_m(const Delta& arm) {
  return to_dhd(arm.pose().tip_mm * (1 / kMmPerM));
}

/// Without a wrist the orientation is the identity: row by row.
void give_identity(double* matrix) {
  if (matrix == nullptr) return;
  for (std::size_t i = 0; i < 9; ++i) matrix[i] = i % 4 == 0 ? 1 : 0;
}

constexpr std::array<double, 3> kNone{};
constexpr double kDegrees = 57.29577951308232;

int base_angle(double* out, std::size_t axis, double scale, char id) {
  return with_arm(id, [&](Delta& arm) {
    give(out, arm.base_angle_rad[axis] * scale);
    return kOk;
  });
}
int set_base_angle(double angle_rad, std::size_t axis, char id) {
  if (!std::isfinite(angle_rad)) return fail(kInvalid);
  return with_arm(id, [&](Delta& arm) { return arm.base_angle_rad[axis] = angle_rad, kOk; });
}

}  // namespace

KERF_STAND_IN_EXPORT int dhdGetPosition(double* x, double* y, double* z, char id) {
  return with_pose(id, [&](Delta& arm) {
    give(position_m(arm), x, y, z);
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetOrientationRad(double* a, double* b, double* c, char id) {
  return with_pose(id, [&](Delta&) { return give(kNone, a, b, c), kOk; });
}
KERF_STAND_IN_EXPORT int dhdGetOrientationDeg(double* a, double* b, double* c, char id) {
  return dhdGetOrientationRad(a, b, c, id);
}
KERF_STAND_IN_EXPORT int dhdGetOrientationFrame(double* matrix, char id) {
  return with_pose(id, [&](Delta&) { return give_identity(matrix), kOk; });
}
KERF_STAND_IN_EXPORT int dhdGetPositionAndOrientationRad(double* x, double* y, double* z, double* a,
                                                         double* b, double* c, char id) {
  return with_pose(id, [&](Delta& arm) {
    give(position_m(arm), x, y, z);
    give(kNone, a, b, c);
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetPositionAndOrientationDeg(double* x, double* y, double* z, double* a,
                                                         double* b, double* c, char id) {
  return dhdGetPositionAndOrientationRad(x, y, z, a, b, c, id);
}
KERF_STAND_IN_EXPORT int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z,
                                                           double* matrix, char id) {
  return with_pose(id, [&](Delta& arm) {
    give(position_m(arm), x, y, z);
    give_identity(matrix);
    return kOk;
  });
}

KERF_STAND_IN_EXPORT int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  return with_pose(id, [&](Delta& arm) {
    const auto velocity = arm.velocity();
    if (!velocity) return fail(kTimeout);
    give(to_dhd(*velocity * (1 / kMmPerM)), x, y, z);
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdConfigLinearVelocity(int ms, int mode, char id) {
  if (ms < 0 || ms > 1000 || mode < 0) return fail(kInvalid);
  return with_arm(id, [&](Delta& arm) {
    arm.velocity_window_s = ms == 0 ? 0.02 : ms / 1000.0;
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetAngularVelocityRad(double* x, double* y, double* z, char id) {
  return with_pose(id, [&](Delta&) { return give(kNone, x, y, z), kOk; });
}
KERF_STAND_IN_EXPORT int dhdGetAngularVelocityDeg(double* x, double* y, double* z, char id) {
  return dhdGetAngularVelocityRad(x, y, z, id);
}
KERF_STAND_IN_EXPORT int dhdConfigAngularVelocity(int /*ms*/, int /*mode*/, char id) {
  return with_arm(id, [](Delta&) { return kOk; });
}

KERF_STAND_IN_EXPORT int dhdGetButton(int index, char id) {
  if (index < 0 || index >= 32) return fail(kBadIndex);
  return with_arm(id, [&](Delta& arm) {
    if (arm.read() < 0) return fail(kCommunication);
    return (arm.buttons() >> index) % 2 != 0 ? 1 : 0;
  });
}
KERF_STAND_IN_EXPORT unsigned dhdGetButtonMask(char id) {
  unsigned mask = 0;
  static_cast<void>(with_pose(id, [&](Delta& arm) { return mask = arm.buttons(), kOk; }));
  return mask;
}

/// A gripper as a button: an arm without one has none to press, and no document says whether it
/// then refuses.
KERF_STAND_IN_EXPORT int dhdEmulateButton(unsigned char /*on*/, char id) {
  return with_arm(id, [](Delta&) {
    return library().session.settings->refuses_emulation ? fail(kNotAvailable) : kOk;
  });
}

/// Power, connected, started, reset, idle, force, brake, torque, wrist, error, gravity, time guard,
/// wrist initialised, redundancy, cause of no force, locks, axes checked.
KERF_STAND_IN_EXPORT int dhdGetStatus(int* status, char id) {
  if (status == nullptr) return fail(kNullArgument);
  return with_arm(id, [&](Delta& arm) {
    using Mode = Delta::Mode;
    const auto is = [&](Mode mode) { return arm.mode() == mode ? 1 : 0; };
    const std::array<int, kStatusWords> words{1,
                                              arm.read() < 0 ? 0 : 1,
                                              1,
                                              is(Mode::reset),
                                              is(Mode::idle),
                                              is(Mode::force),
                                              is(Mode::brake),
                                              0,
                                              0,
                                              0,
                                              arm.compensates_gravity ? 1 : 0,
                                              arm.guard_us > 0 ? 1 : 0,
                                              0,
                                              0,
                                              static_cast<int>(arm.cause()),
                                              0,
                                              arm.is_initialised ? 7 : 0};
    // A client of an earlier SDK has room for 16.
    const std::ptrdiff_t last = library().session.settings->short_status ? 1 : 0;
    std::copy(words.begin(), words.end() - last, status);
    return kOk;
  });
}

// Angles of the base: kept, and without effect, since the emulated weight counts as balanced.
KERF_STAND_IN_EXPORT int dhdGetBaseAngleXRad(double* angle, char id) {
  return base_angle(angle, 0, 1, id);
}
KERF_STAND_IN_EXPORT int dhdGetBaseAngleXDeg(double* angle, char id) {
  return base_angle(angle, 0, kDegrees, id);
}
KERF_STAND_IN_EXPORT int dhdGetBaseAngleZRad(double* angle, char id) {
  return base_angle(angle, 1, 1, id);
}
KERF_STAND_IN_EXPORT int dhdGetBaseAngleZDeg(double* angle, char id) {
  return base_angle(angle, 1, kDegrees, id);
}
KERF_STAND_IN_EXPORT int dhdSetBaseAngleXRad(double angle, char id) {
  return set_base_angle(angle, 0, id);
}
KERF_STAND_IN_EXPORT int dhdSetBaseAngleXDeg(double angle, char id) {
  return set_base_angle(angle / kDegrees, 0, id);
}
KERF_STAND_IN_EXPORT int dhdSetBaseAngleZRad(double angle, char id) {
  return set_base_angle(angle, 1, id);
}
KERF_STAND_IN_EXPORT int dhdSetBaseAngleZDeg(double angle, char id) {
  return set_base_angle(angle / kDegrees, 1, id);
}
KERF_STAND_IN_EXPORT int dhdGetDeviceAngleRad(double* angle, char id) {
  return with_arm(id, [&](Delta& arm) { return give(angle, arm.device_angle_rad), kOk; });
}
KERF_STAND_IN_EXPORT int dhdGetDeviceAngleDeg(double* angle, char id) {
  return with_arm(id,
                  [&](Delta& arm) { return give(angle, arm.device_angle_rad * kDegrees), kOk; });
}
KERF_STAND_IN_EXPORT int dhdSetDeviceAngleRad(double angle, char id) {
  if (!std::isfinite(angle)) return fail(kInvalid);
  return with_arm(id, [&](Delta& arm) { return arm.device_angle_rad = angle, kOk; });
}
KERF_STAND_IN_EXPORT int dhdSetDeviceAngleDeg(double angle, char id) {
  return dhdSetDeviceAngleRad(angle / kDegrees, id);
}
// NOLINTEND(readability-identifier-naming)
