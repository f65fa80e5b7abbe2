// SPDX-License-Identifier: Apache-2.0
// Functions of dhd that open, close and describe a device, and those of the operating system.

#include <algorithm>
#include <cstdint>

#include <poll.h>
#include <unistd.h>

#include "shared/posix/monotonic_clock.hpp"
#include "standin/dhd/library.hpp"

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::dhd;  // NOLINT(google-build-using-namespace): the interface is global

namespace {

bool is_there() {
  const Library& lib = library();
  return lib.session.settings && lib.session.settings->device == kerf::Personality::omega;
}

bool is_open(char id) {
  return with_arm(id, [](Delta&) { return kOk; }) == kOk;
}

}  // namespace

KERF_STAND_IN_EXPORT int dhdOpen() {
  return library().open();
}
KERF_STAND_IN_EXPORT int dhdOpenID(char index) {
  return index == 0 || index == static_cast<char>(-1) ? library().open() : fail(kBadIndex);
}
KERF_STAND_IN_EXPORT int dhdOpenSerial(int serial) {
  return serial == kSerialNumber ? library().open() : fail(kNoDevice);
}
KERF_STAND_IN_EXPORT int dhdOpenType(int type) {
  return type == kOmega3 ? library().open() : fail(kNoDevice);
}
KERF_STAND_IN_EXPORT int dhdClose(char id) {
  return with_arm(id, [](Delta&) { return library().close(); });
}
KERF_STAND_IN_EXPORT int dhdGetDeviceCount() {
  return is_there() ? 1 : 0;
}
KERF_STAND_IN_EXPORT int dhdGetAvailableCount() {
  const std::lock_guard lock(library().mutex);
  return is_there() && !library().device ? 1 : 0;
}
KERF_STAND_IN_EXPORT int dhdSetDevice(char id) {
  return is_open(id) ? kOk : kFailed;
}
KERF_STAND_IN_EXPORT int dhdGetDeviceID() {
  return is_open(0) ? 0 : kFailed;
}
KERF_STAND_IN_EXPORT int dhdGetSerialNumber(std::uint16_t* serial, char id) {
  return with_arm(id, [&](Delta&) {
    give(serial, std::uint16_t{kSerialNumber});
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetSystemType(char id) {
  return with_arm(id, [](Delta&) { return kOmega3; });
}
KERF_STAND_IN_EXPORT int dhdGetSystemRev(char id) {
  return with_arm(id, [](Delta&) { return 0; });
}
KERF_STAND_IN_EXPORT const char* dhdGetSystemName(char id) {
  return is_open(id) ? "omega.3 (kerf stand-in)" : nullptr;
}
KERF_STAND_IN_EXPORT int dhdGetVersion(double* version, char id) {
  return with_arm(id, [&](Delta&) {
    give(version, 3.0);  // of a firmware that has a watchdog
    return kOk;
  });
}
KERF_STAND_IN_EXPORT void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  give(major, kSdkVersion[0]);
  give(minor, kSdkVersion[1]);
  give(release, kSdkVersion[2]);
  give(revision, kSdkVersion[3]);
}
KERF_STAND_IN_EXPORT int dhdCheckControllerMemory(char id) {
  return with_arm(id, [](Delta&) { return kOk; });
}

// Parts of an omega.3: a base alone.
KERF_STAND_IN_EXPORT bool dhdHasBase(char id) {
  return is_open(id);
}
KERF_STAND_IN_EXPORT bool dhdHasWrist(char /*id*/) {
  return false;
}
KERF_STAND_IN_EXPORT bool dhdHasActiveWrist(char /*id*/) {
  return false;
}
KERF_STAND_IN_EXPORT bool dhdHasGripper(char /*id*/) {
  return false;
}
KERF_STAND_IN_EXPORT bool dhdHasActiveGripper(char /*id*/) {
  return false;
}
KERF_STAND_IN_EXPORT bool dhdIsLeftHanded(char /*id*/) {
  return false;
}

KERF_STAND_IN_EXPORT int dhdErrorGetLast() {
  return last_error();
}
KERF_STAND_IN_EXPORT const char* dhdErrorGetLastStr() {
  return text_of(last_error());
}
KERF_STAND_IN_EXPORT const char* dhdErrorGetStr(int code) {
  return text_of(code);
}

KERF_STAND_IN_EXPORT int dhdEnableExpertMode() {
  library().is_expert = true;
  return kOk;
}
KERF_STAND_IN_EXPORT int dhdDisableExpertMode() {
  library().is_expert = false;
  return kOk;
}

KERF_STAND_IN_EXPORT int dhdGetComMode(char id) {
  return with_arm(id, [](Delta& arm) { return arm.com_mode; });
}
KERF_STAND_IN_EXPORT int dhdSetComMode(int mode, char id) {
  if (mode < 0 || mode > 4) return fail(kInvalid);
  return with_arm(id, [&](Delta& arm) { return arm.com_mode = mode, kOk; });
}
KERF_STAND_IN_EXPORT int dhdSetComModePriority(int /*priority*/, char id) {
  return with_arm(id, [](Delta&) { return kOk; });
}
/// The vendor's own simulator has nothing to do with this one.
KERF_STAND_IN_EXPORT void dhdEnableSimulator(bool /*on*/) {}

// Time. In lock-step it is the device's, and a sleep moves it.
KERF_STAND_IN_EXPORT double dhdGetTime() {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  if (lib.lockstep()) return lib.device ? lib.device->time_s() : 0;
  return static_cast<double>(kerf::monotonic_ns()) / kerf::kNsPerSecond;
}
KERF_STAND_IN_EXPORT void dhdSleep(double seconds) {
  Library& lib = library();
  if (!(seconds > 0)) return;
  seconds = std::min(seconds, 1e6);
  if (!lib.lockstep()) {
    kerf::sleep_until_ns(kerf::monotonic_ns() +
                         static_cast<std::int64_t>(seconds * kerf::kNsPerSecond));
    return;
  }
  const std::lock_guard lock(lib.mutex);
  if (!lib.device) return;
  const double until_s = lib.device->time_s() + seconds;
  while (lib.device->time_s() < until_s && lib.device->read() >= 0) lib.device->tick();
}

// The keyboard.
KERF_STAND_IN_EXPORT bool dhdKbHit() {
  pollfd keys{STDIN_FILENO, POLLIN, 0};
  return isatty(STDIN_FILENO) == 1 && poll(&keys, 1, 0) > 0;
}
KERF_STAND_IN_EXPORT char dhdKbGet() {
  char key = 0;
  return read(STDIN_FILENO, &key, 1) == 1 ? key : '\0';
}
// NOLINTEND(readability-identifier-naming)
