// SPDX-License-Identifier: Apache-2.0
// Functions of drd: regulation of the position by a spring and a damper. Of a real device the
// gains and the smooth start and end of a motion are not known; here the target has a constant
// speed.

#include <cmath>

#include "shared/posix/monotonic_clock.hpp"
#include "standin/dhd/library.hpp"

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::dhd;  // NOLINT(google-build-using-namespace): the interface is global

namespace {

constexpr int kPatienceMs = 2000;  // of a motion that a hand holds up, beyond its own time

/// With a regulator that runs.
template <class Use>
int with_robot(char id, const Use& use) {
  return with_arm(id, [&](Delta& arm) { return arm.regulates() ? use(arm) : fail(kNoRegulation); });
}

bool is_true(char id, bool (Delta::*what)() const noexcept) {
  return with_arm(id, [&](Delta& arm) { return (arm.*what)() ? 1 : 0; }) == 1;
}

/// One tick of the regulator: the next one in real time, one of the device's in lock-step.
void wait_for_tick(char id) {
  Library& lib = library();
  if (!lib.lockstep()) {
    kerf::sleep_until_ns(kerf::monotonic_ns() + kerf::kNsPerSecond / 1000);
    return;
  }
  static_cast<void>(with_arm(id, [](Delta& arm) { return arm.tick(), kOk; }));
}

int move_to(double x, double y, double z, bool waits, char id) {
  if (!std::isfinite(x + y + z)) return fail(kInvalid);
  double patience_s = kPatienceMs / 1000.0, began_s = 0;
  const int sent = with_robot(id, [&](Delta& arm) {
    const auto goal_mm = from_dhd(x, y, z) * kMmPerM;
    arm.go_to(goal_mm, arm.moving);
    patience_s += norm(goal_mm - arm.pose().tip_mm) / (arm.moving.speed * kMmPerM);
    began_s = arm.time_s();
    return kOk;
  });
  while (sent == kOk && waits && is_true(id, &Delta::moves)) {
    wait_for_tick(id);
    const int in_time = with_robot(id, [&](Delta& arm) {
      if (arm.read() < 0) return fail(kCommunication);
      return arm.time_s() - began_s < patience_s ? kOk : fail(kTimeout);
    });
    if (in_time != kOk) return in_time;
  }
  return sent;
}

int track(double x, double y, double z, char id) {
  if (!std::isfinite(x + y + z)) return fail(kInvalid);
  return with_robot(id, [&](Delta& arm) {
    arm.go_to(from_dhd(x, y, z) * kMmPerM, arm.tracking);
    return kOk;
  });
}

int set_profile(Profile Delta::*which, const Profile& profile, char id) {
  const bool is_positive = profile.speed > 0 && profile.acceleration > 0 && profile.jerk > 0;
  if (!is_positive || !std::isfinite(profile.speed)) return fail(kInvalid);
  return with_arm(id, [&](Delta& arm) { return arm.*which = profile, kOk; });
}
int get_profile(Profile Delta::*which, double* speed, double* acceleration, double* jerk, char id) {
  return with_arm(id, [&](Delta& arm) {
    const Profile& profile = arm.*which;
    give({profile.speed, profile.acceleration, profile.jerk}, speed, acceleration, jerk);
    return kOk;
  });
}

/// The emulated axes count from their absolute position, so nothing has to move.
int initialise(char id) {
  return with_arm(id, [](Delta& arm) { return arm.is_initialised = true, kOk; });
}

}  // namespace

KERF_STAND_IN_EXPORT int drdOpen() {
  return library().open_first();
}
KERF_STAND_IN_EXPORT int drdOpenID(char index) {
  return library().open_index(index);
}
KERF_STAND_IN_EXPORT int drdSetDevice(char id) {
  return library().select(id);
}
KERF_STAND_IN_EXPORT int drdGetDeviceID() {
  return library().default_id();
}
KERF_STAND_IN_EXPORT int drdClose(char id) {
  return library().close(id);
}
KERF_STAND_IN_EXPORT bool drdIsSupported(char id) {
  return with_arm(id, [](Delta&) { return kOk; }) == kOk;
}
KERF_STAND_IN_EXPORT bool drdIsInitialized(char id) {
  return with_arm(id, [](Delta& arm) { return arm.is_initialised ? 1 : 0; }) == 1;
}
KERF_STAND_IN_EXPORT bool drdIsRunning(char id) {
  return is_true(id, &Delta::regulates);
}
KERF_STAND_IN_EXPORT bool drdIsMoving(char id) {
  return is_true(id, &Delta::moves);
}
KERF_STAND_IN_EXPORT bool drdIsFiltering(char id) {
  return with_arm(id, [](Delta& arm) { return arm.filters ? 1 : 0; }) == 1;
}
KERF_STAND_IN_EXPORT int drdAutoInit(char id) {
  return initialise(id);
}
KERF_STAND_IN_EXPORT int drdCheckInit(char id) {
  return initialise(id);
}
KERF_STAND_IN_EXPORT int drdPrecisionInit(char id) {
  return initialise(id);
}

KERF_STAND_IN_EXPORT int drdStart(char id) {
  return with_arm(id, [](Delta& arm) {
    if (!arm.start()) return fail(kNotReady);
    library().keep_ticking();
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int drdStop(bool force_on, char id) {
  return with_arm(id, [&](Delta& arm) { return arm.stop(force_on), kOk; });
}
KERF_STAND_IN_EXPORT int drdRegulatePos(bool on, char id) {
  return with_arm(id, [&](Delta& arm) {
    if (on && !arm.regulates_position) arm.hold();
    arm.regulates_position = on;
    return kOk;
  });
}
/// An omega.3 has neither; switching what is not there off or on changes nothing.
KERF_STAND_IN_EXPORT int drdRegulateRot(bool /*on*/, char id) {
  return with_arm(id, [](Delta&) { return kOk; });
}
KERF_STAND_IN_EXPORT int drdRegulateGrip(bool /*on*/, char id) {
  return with_arm(id, [](Delta&) { return kOk; });
}
KERF_STAND_IN_EXPORT int drdSetForceAndTorqueAndGripperForce(double x, double y, double z,
                                                             double /*tx*/, double /*ty*/,
                                                             double /*tz*/, double /*grip*/,
                                                             char id) {
  if (!std::isfinite(x + y + z)) return fail(kInvalid);
  return with_robot(id, [&](Delta& arm) { return arm.free_force_n = from_dhd(x, y, z), kOk; });
}
KERF_STAND_IN_EXPORT int drdEnableFilter(bool on, char id) {
  return with_arm(id, [&](Delta& arm) { return arm.filters = on, kOk; });
}
KERF_STAND_IN_EXPORT int drdTrackPos(double x, double y, double z, char id) {
  return track(x, y, z, id);
}
KERF_STAND_IN_EXPORT int drdTrack(double* p, char id) {
  return p == nullptr ? fail(kNullArgument) : track(p[0], p[1], p[2], id);
}
KERF_STAND_IN_EXPORT int drdMoveToPos(double x, double y, double z, bool waits, char id) {
  return move_to(x, y, z, waits, id);
}
KERF_STAND_IN_EXPORT int drdMoveTo(double* p, bool waits, char id) {
  return p == nullptr ? fail(kNullArgument) : move_to(p[0], p[1], p[2], waits, id);
}
KERF_STAND_IN_EXPORT int drdHold(char id) {
  return with_robot(id, [](Delta& arm) { return arm.hold(), kOk; });
}
KERF_STAND_IN_EXPORT void drdWaitForTick(char id) {
  wait_for_tick(id);
}
KERF_STAND_IN_EXPORT double drdGetCtrlFreq(char id) {
  double khz = kFailed;
  static_cast<void>(with_robot(id, [&](Delta& arm) { return khz = arm.command_khz(), kOk; }));
  return khz;
}
KERF_STAND_IN_EXPORT int drdGetPositionAndOrientation(double* x, double* y, double* z, double* a,
                                                      double* b, double* c, double* grip,
                                                      double* matrix, char id) {
  return with_pose(id, [&](Delta& arm) {
    give(to_dhd(arm.pose().tip_mm * (1 / kMmPerM)), x, y, z);
    give({}, a, b, c);
    give(grip, 0.0);
    for (std::size_t i = 0; matrix != nullptr && i < 9; ++i) matrix[i] = i % 4 == 0 ? 1 : 0;
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int drdGetVelocity(double* x, double* y, double* z, double* a, double* b,
                                        double* c, double* grip, char id) {
  return with_pose(id, [&](Delta& arm) {
    give(to_dhd(arm.velocity().value_or(kerf::DeviceVec<double>{}) * (1 / kMmPerM)), x, y, z);
    give({}, a, b, c);
    give(grip, 0.0);
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int drdSetPosMoveParam(double speed, double acceleration, double jerk,
                                            char id) {
  return set_profile(&Delta::moving, {speed, acceleration, jerk}, id);
}
KERF_STAND_IN_EXPORT int drdGetPosMoveParam(double* speed, double* acceleration, double* jerk,
                                            char id) {
  return get_profile(&Delta::moving, speed, acceleration, jerk, id);
}
KERF_STAND_IN_EXPORT int drdSetPosTrackParam(double speed, double acceleration, double jerk,
                                             char id) {
  return set_profile(&Delta::tracking, {speed, acceleration, jerk}, id);
}
KERF_STAND_IN_EXPORT int drdGetPosTrackParam(double* speed, double* acceleration, double* jerk,
                                             char id) {
  return get_profile(&Delta::tracking, speed, acceleration, jerk, id);
}
/// Kept: the regulator of the stand-in has no thread priorities.
KERF_STAND_IN_EXPORT int drdSetPriorities(int control, int caller, char id) {
  return with_arm(id, [&](Delta& arm) { return arm.priorities = {control, caller}, kOk; });
}
KERF_STAND_IN_EXPORT int drdGetPriorities(int* control, int* caller, char id) {
  return with_arm(id, [&](Delta& arm) {
    give(control, arm.priorities[0]);
    give(caller, arm.priorities[1]);
    return kOk;
  });
}
// NOLINTEND(readability-identifier-naming)
