// SPDX-License-Identifier: Apache-2.0
// The 36 functions of the HD interface, over Library. Names and shapes are facts of the interface;
// the bodies are ours.

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <mutex>
#include <string>

#include "standin/hd/library.hpp"

namespace kerf::hd {
namespace {

using standin::Row;

template <class T>
void get(Enum name, T* out, unsigned type) {
  with_device(0, [&](Touch& device) {
    if (out == nullptr) {
      library().refuse(kInvalidValue);
      return 0;
    }
    const auto values = device.read(name, type);
    for (std::size_t i = 0; values && i < values->count; ++i) {
      out[i] = static_cast<T>(type == kInt || type == kLong ? std::round(values->value[i])
                                                            : values->value[i]);
    }
    return 0;
  });
}

template <class T>
void set(Enum name, const T* in, unsigned type) {
  with_device(0, [&](Touch& device) {
    const std::size_t count = device.writes(name, type);
    if (count > 0 && in == nullptr) library().refuse(kInvalidValue);
    if (count == 0 || in == nullptr) return 0;
    std::array<double, 16> value{};
    for (std::size_t i = 0; i < count; ++i) value[i] = static_cast<double>(in[i]);
    device.write(name, value);
    return 0;
  });
}

}  // namespace
}  // namespace kerf::hd

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::hd;  // NOLINT(google-build-using-namespace): the interface is global

// Devices and frames.

KERF_STAND_IN_EXPORT Handle hdInitDevice(const char* name) {
  return library().open_device(name);
}

KERF_STAND_IN_EXPORT void hdDisableDevice(Handle handle) {
  library().close(handle);
}

KERF_STAND_IN_EXPORT void hdMakeCurrentDevice(Handle handle) {
  with_handle(handle, [&](Touch&) { library().current = handle; });
}

KERF_STAND_IN_EXPORT Handle hdGetCurrentDevice() {
  return library().current;
}

KERF_STAND_IN_EXPORT void hdBeginFrame(Handle handle) {
  with_handle(handle, [&](Touch& device) {
    library().current = handle;
    device.begin_frame();
  });
}

KERF_STAND_IN_EXPORT void hdEndFrame(Handle handle) {
  with_handle(handle, [](Touch& device) { device.end_frame(); });
}

KERF_STAND_IN_EXPORT ErrorInfo hdGetError() {
  return library().errors.pop();
}

KERF_STAND_IN_EXPORT const char* hdGetErrorString(Enum code) {
  return text_of(code);
}

// Capabilities and parameters.

KERF_STAND_IN_EXPORT void hdEnable(Enum capability) {
  with_device(0, [&](Touch& device) { return device.enable(capability, true), 0; });
}

KERF_STAND_IN_EXPORT void hdDisable(Enum capability) {
  with_device(0, [&](Touch& device) { return device.enable(capability, false), 0; });
}

KERF_STAND_IN_EXPORT Boolean hdIsEnabled(Enum capability) {
  return with_device(Boolean{0}, [&](Touch& device) {
    return static_cast<Boolean>(device.is_enabled(capability) ? 1 : 0);
  });
}

KERF_STAND_IN_EXPORT void hdGetBooleanv(Enum name, Boolean* out) {
  get(name, out, kBool);
}
KERF_STAND_IN_EXPORT void hdGetIntegerv(Enum name, Int* out) {
  get(name, out, kInt);
}
KERF_STAND_IN_EXPORT void hdGetFloatv(Enum name, float* out) {
  get(name, out, kFloat);
}
KERF_STAND_IN_EXPORT void hdGetDoublev(Enum name, double* out) {
  get(name, out, kDouble);
}
KERF_STAND_IN_EXPORT void hdGetLongv(Enum name, Long* out) {
  get(name, out, kLong);
}
KERF_STAND_IN_EXPORT void hdSetBooleanv(Enum name, const Boolean* in) {
  set(name, in, kBool);
}
KERF_STAND_IN_EXPORT void hdSetIntegerv(Enum name, const Int* in) {
  set(name, in, kInt);
}
KERF_STAND_IN_EXPORT void hdSetFloatv(Enum name, const float* in) {
  set(name, in, kFloat);
}
KERF_STAND_IN_EXPORT void hdSetDoublev(Enum name, const double* in) {
  set(name, in, kDouble);
}
KERF_STAND_IN_EXPORT void hdSetLongv(Enum name, const Long* in) {
  set(name, in, kLong);
}

KERF_STAND_IN_EXPORT const char* hdGetString(Enum name) {
  if (name == kVersion) return "3.30.0 kerf stand-in " KERF_VERSION;
  return with_device<const char*>(nullptr, [&](Touch& device) { return device.text(name); });
}

// Calibration.

KERF_STAND_IN_EXPORT Enum hdCheckCalibration() {
  return with_device(Enum{kNeedsHand}, [](Touch& device) { return device.calibration(); });
}

KERF_STAND_IN_EXPORT void hdUpdateCalibration(Enum style) {
  with_device(0, [&](Touch& device) {
    if (style == kInkwellStyle) {
      device.calibrate();
    } else {
      library().refuse(kInvalidValue);
    }
    return 0;
  });
}

KERF_STAND_IN_EXPORT Enum hdCheckCalibrationStyle() {
  return kInkwellStyle;
}

KERF_STAND_IN_EXPORT void hdUpdateCalibrationMessage(Enum /*style*/) {}

KERF_STAND_IN_EXPORT void hdScaleGimbalAngles(double x, double y, double z, double* transform) {
  with_device(0, [&](Touch& device) {
    const Transform16 scaled = device.with_scaled_gimbal({x, y, z});
    if (transform != nullptr) std::copy(scaled.begin(), scaled.end(), transform);
    return 0;
  });
}

KERF_STAND_IN_EXPORT Boolean hdDeploymentLicense(const char* /*vendor*/, const char* /*program*/,
                                                 const char* /*password*/) {
  return 1;
}

// The scheduler.

KERF_STAND_IN_EXPORT void hdStartScheduler() {
  Library& lib = library();
  if (lib.scheduler.is_servo_thread() && lib.scheduler.stops()) {
    return lib.refuse(kInvalidOperation);
  }
  lib.scheduler.finish_stop();  // the devices stop before they run again
  lib.run(true);
  try {
    lib.scheduler.start(lib.lockstep(), lib.rate_hz, lib.priority());
  } catch (const std::exception&) {  // the system has no thread left
    lib.run(false);
    lib.refuse(kTimer);
  }
}

KERF_STAND_IN_EXPORT void hdStopScheduler() {
  Library& lib = library();
  lib.scheduler.stop();
  lib.run(false);
}

KERF_STAND_IN_EXPORT void hdSetSchedulerRate(Ulong hertz) {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  constexpr std::array<Ulong, 4> kRates{500, 1000, 1600, 2000};
  const bool is_rate = std::find(kRates.begin(), kRates.end(), hertz) != kRates.end();
  // In lock-step the emulator's tick is fixed, and a running thread keeps its own.
  const bool is_now = static_cast<int>(hertz) == lib.rate_hz;
  if (!is_rate || (!is_now && lib.lockstep())) return lib.refuse(kInvalidValue);
  if (!is_now && lib.scheduler.runs()) return lib.refuse(kInvalidOperation);
  lib.rate_hz = static_cast<int>(hertz);
}

KERF_STAND_IN_EXPORT void hdScheduleSynchronous(Callback callback, void* data,
                                                std::uint16_t priority) {
  Library& lib = library();
  if (callback == nullptr) return lib.refuse(kInvalidValue);
  if (!lib.scheduler.runs() || lib.scheduler.is_servo_thread()) {
    return lib.scheduler.run_here(callback, data);
  }
  if (!lib.scheduler.run_there(callback, data, priority)) lib.refuse(kSchedulerFull);
}

KERF_STAND_IN_EXPORT Ulong hdScheduleAsynchronous(Callback callback, void* data,
                                                  std::uint16_t priority) {
  Library& lib = library();
  if (callback == nullptr) {
    lib.refuse(kInvalidValue);
    return 0;
  }
  if (lib.scheduler.is_servo_thread() && callback(data) == kDone) return 0;
  const Ulong handle = lib.scheduler.add(callback, data, priority);
  if (handle == 0) lib.refuse(kSchedulerFull);
  return handle;
}

KERF_STAND_IN_EXPORT void hdUnschedule(Ulong handle) {
  Library& lib = library();
  if (lib.scheduler.remove(handle)) return;
  lib.session.ledger->add(Row::bad_schedules);
  lib.refuse(kInvalidValue);
}

KERF_STAND_IN_EXPORT Boolean hdWaitForCompletion(Ulong handle, Uint how) {
  Library& lib = library();
  if (how == kWaitForEnd && !lib.scheduler.is_servo_thread()) lib.scheduler.wait(handle);
  return lib.scheduler.has(handle) ? 1 : 0;
}

KERF_STAND_IN_EXPORT double hdGetSchedulerTimeStamp() {
  Library& lib = library();
  return lib.lockstep() ? 0.0 : lib.scheduler.since_tick_s();
}
// NOLINTEND(readability-identifier-naming)

// Not of the interface: ./kerf stand-in asks here what is wrong with a --switch. Null: nothing;
// else a line, until the next call of the thread.
KERF_STAND_IN_EXPORT const char* kerf_stand_in_refusal_of_switch(const char* word) {
  thread_local std::string line;
  line = kerf::standin::refusal_of_switch(word != nullptr ? word : "");
  return line.empty() ? nullptr : line.c_str();
}
