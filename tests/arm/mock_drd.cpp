// SPDX-License-Identifier: Apache-2.0
// A libdrd.so.3 for the tests of kerf-arm, from the documentation of its C interface: one arm, and
// every call that matters in the record. A call that leaves the ID out passes a random one: each
// one but the open one's is refused.
#include <array>
#include <cstdint>
#include <limits>

#include "tests/arm/mock_script.hpp"

namespace {

using kerf::mock::Behaviour;
using kerf::mock::Pose;
using kerf::mock::Record;

constexpr int kErrorCom = 2, kErrorNoDevice = 5, kErrorExpert = 9, kErrorNotAvailable = 6;
constexpr int kErrorInvalidIndex = 15, kErrorInUse = 20;

thread_local int last_error = 0;

struct Library {
  Behaviour behaviour;
  Record record;
  std::vector<Pose> poses = kerf::mock::read_poses({0, 0, 0.05});
  bool open = false, expert = false, force_enabled = false;
  long cycle = 0;  ///< of positions read
  std::array<double, 3> force{};

  [[nodiscard]] char id() const { return static_cast<char>(behaviour.number("id", 0)); }
  [[nodiscard]] const Pose& pose() const { return kerf::mock::pose_at(poses, cycle); }
};

Library& library() {
  static auto& the_library = *new Library;
  return the_library;
}

int fail(int code) {
  last_error = code;
  return -1;
}

/// 0 if this is the open device and it answers.
int check(char id) {
  Library& drd = library();
  if (!drd.open || id != drd.id()) return fail(kErrorInvalidIndex);
  const long gone = drd.behaviour.number("vanish", -1), back = drd.behaviour.number("back", -1);
  if (gone >= 0 && drd.cycle >= gone && (back < 0 || drd.cycle < back)) return fail(kErrorCom);
  return 0;
}

int open_device() {
  Library& drd = library();
  kerf::mock::take_signals(drd.behaviour);
  if (drd.behaviour.has("hang_open")) kerf::mock::hang();
  if (drd.behaviour.has("crash_open")) kerf::mock::crash();
  if (drd.behaviour.has("exit_open")) std::exit(0);
  if (drd.behaviour.has("init_error")) return fail(kErrorNoDevice);
  if (drd.open) return fail(kErrorInUse);
  drd.open = true;
  return drd.id();
}

}  // namespace

extern "C" {

// For the tests alone.
int kerf_mock_lines(const char** out, int room) {
  return library().record.give_lines(out, room);
}
void kerf_mock_pose(const double* position, const double*, int buttons, int) {
  Pose pose{.tick = library().cycle, .buttons = buttons};
  for (std::size_t i = 0; i < 3; ++i) pose.position[i] = position[i];
  library().poses.push_back(pose);
}

int drdOpen() {
  library().record.add("drdOpen");
  return open_device();
}
int drdOpenID(char index) {
  library().record.add("drdOpenID %d", index);
  if (index != 0) return fail(kErrorInvalidIndex);
  return open_device();
}
int drdClose(char id) {
  library().record.add("drdClose");
  if (library().behaviour.has("crash_close")) kerf::mock::crash();
  if (library().behaviour.has("hang_close")) kerf::mock::hang();
  if (check(id) != 0) return -1;
  library().open = false;
  return 0;
}
bool drdIsInitialized(char id) {
  const long lost = library().behaviour.number("uncalibrated", -1);
  if (lost >= 0 && library().cycle >= lost) return false;
  return check(id) == 0 && !library().behaviour.has("not_homed");
}
int drdAutoInit(char id) {
  library().record.add("drdAutoInit");
  if (library().behaviour.has("hang_init")) kerf::mock::hang();
  return check(id);
}
int drdStop(bool leaves_force, char id) {
  library().record.add("drdStop %d", leaves_force ? 1 : 0);
  return check(id);
}

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  *major = static_cast<int>(library().behaviour.number("version", 3));
  *minor = 17;
  *release = 5;
  *revision = 0;
}
int dhdGetSystemType(char id) {
  return check(id) == 0 ? static_cast<int>(library().behaviour.number("type", 33)) : -1;
}
const char* dhdGetSystemName(char id) {
  return check(id) == 0 && !library().behaviour.has("null_strings") ? "mock omega.3" : nullptr;
}
int dhdGetStatus(int* words, char id) {
  constexpr int kForce = 5, kBrake = 6, kForceOffCause = 14, kVelocity = 2;
  for (int i = 0; i < 17; ++i) words[i] = 0;
  if (check(id) != 0) return -1;
  words[kForce] = library().force_enabled ? 1 : 0;
  words[kBrake] = 1 - words[kForce];
  words[kForceOffCause] = words[kBrake] * kVelocity;
  return 0;
}
int dhdErrorGetLast() {
  return last_error;
}
const char* dhdErrorGetLastStr() {
  return last_error == kErrorCom ? "communication error of the mock" : "error of the mock";
}

int dhdEnableExpertMode() {
  library().record.add("dhdEnableExpertMode");
  library().expert = true;
  return 0;
}
int dhdDisableExpertMode() {
  library().record.add("dhdDisableExpertMode");
  library().expert = false;
  return 0;
}
int dhdSetWatchdog(unsigned char units, char id) {
  Library& drd = library();
  if (check(id) != 0) return -1;
  if (drd.behaviour.has("old_firmware")) return fail(kErrorNotAvailable);
  if (drd.behaviour.has("expert_watchdog") && !drd.expert) return fail(kErrorExpert);
  drd.record.add("dhdSetWatchdog %u", units);
  return 0;
}
int dhdSetVelocityThreshold(unsigned int threshold, char id) {
  library().record.add("dhdSetVelocityThreshold %u", threshold);
  return check(id);
}

#ifndef KERF_MOCK_LACKS_FORCE
int dhdEnableForce(unsigned char on, char id) {
  library().record.add("dhdEnableForce %u", on);
  if (on != 0 && library().behaviour.has("hang_start")) kerf::mock::hang();
  if (on == 0 && library().behaviour.has("hang_stop")) kerf::mock::hang();
  if (check(id) != 0) return -1;
  library().force_enabled = on != 0;
  return 0;
}
int dhdSetForce(double x, double y, double z, char id) {
  Library& drd = library();
  if (check(id) != 0) return -1;
  drd.force = drd.force_enabled ? std::array{x, y, z} : std::array<double, 3>{};
  drd.record.add("force %ld %.6f %.6f %.6f", drd.cycle, drd.force[0], drd.force[1], drd.force[2]);
  return drd.behaviour.has("saturated") ? 2 : 0;
}
int dhdSetForceAndGripperForce(double x, double y, double z, double, char id) {
  return dhdSetForce(x, y, z, id);
}
#endif

int dhdGetPosition(double* x, double* y, double* z, char id) {
  Library& drd = library();
  if (++drd.cycle == 1) kerf::mock::take_signals(drd.behaviour);
  if (drd.cycle == drd.behaviour.number("hang_callback", -1)) kerf::mock::hang();
  kerf::mock::end_process(drd.behaviour, drd.cycle);
  // Too fast: the forces go off, and the motors brake.
  if (drd.cycle == drd.behaviour.number("too_fast", -1)) drd.force_enabled = false;
  if (check(id) != 0) return -1;
  const Pose& pose = drd.pose();
  *x = pose.position[0];
  *y = pose.position[1];
  *z = pose.position[2];
  if (drd.cycle == drd.behaviour.number("nan", -1)) *y = std::numeric_limits<double>::quiet_NaN();
  return drd.behaviour.has("reused") ? 1 : 0;
}
int dhdGetButton(int index, char id) {
  if (check(id) != 0) return -1;
  return (library().pose().buttons >> index) & 1;
}

}  // extern "C"
