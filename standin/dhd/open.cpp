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

bool is_open(char id) {
  return with_arm(id, [](Delta&) { return kOk; }) == kOk;
}

}  // namespace

KERF_STAND_IN_EXPORT int dhdOpen() {
  return library().open_first();
}
KERF_STAND_IN_EXPORT int dhdOpenID(char index) {
  return library().open_index(index);
}
KERF_STAND_IN_EXPORT int dhdOpenSerial(int serial) {
  const int number = serial - kFirstSerialNumber;
  const bool is_there =
      number >= 0 && static_cast<std::size_t>(number) < library().session.devices.size();
  return is_there ? library().open_index(static_cast<char>(number)) : fail(kNoDevice);
}
KERF_STAND_IN_EXPORT int dhdOpenType(int type) {
  return type == kOmega3 ? library().open_first() : fail(kNoDevice);
}
KERF_STAND_IN_EXPORT int dhdClose(char id) {
  return library().close(id);
}
KERF_STAND_IN_EXPORT int dhdGetDeviceCount() {
  return static_cast<int>(library().session.devices.size());
}
KERF_STAND_IN_EXPORT int dhdGetAvailableCount() {
  const std::lock_guard lock(library().mutex);
  return library().available();
}
KERF_STAND_IN_EXPORT int dhdSetDevice(char id) {
  return library().select(id);
}
KERF_STAND_IN_EXPORT int dhdGetDeviceID() {
  return library().default_id();
}
KERF_STAND_IN_EXPORT int dhdGetSerialNumber(std::uint16_t* serial, char id) {
  return with_arm(id, [&](Delta& arm) {
    give(serial, static_cast<std::uint16_t>(kFirstSerialNumber + arm.device().number));
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

// Time. In lock-step each device has its own, and a sleep moves all of them.
KERF_STAND_IN_EXPORT double dhdGetTime() {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  if (lib.lockstep()) return lib.time_s();
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
  for (auto& arm : lib.open) {
    if (!arm) continue;
    const double until_s = arm->time_s() + seconds;
    while (arm->time_s() < until_s && arm->read() >= 0) arm->tick();
  }
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
