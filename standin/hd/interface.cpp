// SPDX-License-Identifier: Apache-2.0
// The 36 functions of the HD interface, over Touch and Scheduler. Names and shapes are facts of the
// interface; the bodies are ours.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "standin/hd/error_stack.hpp"
#include "standin/hd/numbers.hpp"
#include "standin/hd/scheduler.hpp"
#include "standin/hd/touch.hpp"
#include "standin/session.hpp"

namespace kerf::hd {
namespace {

using standin::Row;

/// All state of the library. `mutex` guards the devices; no callback runs while it is held.
struct Library {
  standin::Session session{"libHD", Personality::touch};
  ErrorStack errors;
  std::recursive_mutex mutex;
  std::array<std::optional<Touch>, standin::kMostDevices> open;  ///< by handle
  std::atomic<Handle> current;
  int rate_hz = 1000;
  Scheduler scheduler;

  Library()
      : current(without_device()),
        scheduler({[this] { each(&Touch::begin_tick); }, [this] { each(&Touch::end_tick); }},
                  *session.ledger, session.settings ? session.settings->stall_ms : 50) {
    if (!session.devices.empty()) rate_hz = session.devices.front().settings.rate_hz;
  }

  void each(void (Touch::*what)() noexcept) {
    const std::lock_guard lock(mutex);
    for (auto& touch : open) {
      if (touch) ((*touch).*what)();
    }
  }
  void run(bool runs) {
    const std::lock_guard lock(mutex);
    for (auto& touch : open) {
      if (touch) touch->run(runs, rate_hz);
    }
  }
  /// Null if there is none.
  [[nodiscard]] Touch* find(Handle handle) noexcept {
    return handle < open.size() && open[handle] ? &*open[handle] : nullptr;
  }
  /// The current device if there is none. A client in use runs only if it is the handle that it
  /// gets later.
  [[nodiscard]] Handle without_device() const noexcept {
    const bool is_documented = session.settings && session.settings->documented_handles;
    for (const auto& touch : open) {
      if (touch) return kNoDevice;
    }
    return is_documented ? kNoDevice : kFirstDevice;
  }
  [[nodiscard]] bool lockstep() const noexcept { return session.lockstep(); }
  [[nodiscard]] int priority() const noexcept {
    return session.settings ? session.settings->priority : 0;
  }
  void refuse(Enum code) noexcept { errors.push(code, current); }
};

Library& library() {
  static auto* const kOne = new Library;  // never destroyed: see Session
  return *kOne;
}

/// Calls `use(device)` under the lock; without that device an error, and `otherwise`.
template <class Result, class Use>
Result with_handle(Handle handle, Result otherwise, const Use& use) {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  if (Touch* const touch = lib.find(handle)) return use(*touch);
  lib.session.ledger->add(Row::bad_handles);
  lib.errors.push(kBadHandle, handle);
  return otherwise;
}
template <class Use>
void with_handle(Handle handle, const Use& use) {
  with_handle(handle, 0, [&](Touch& device) { return use(device), 0; });
}

/// The same for the current device.
template <class Result, class Use>
Result with_device(Result otherwise, const Use& use) {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  return with_handle(lib.current, otherwise, use);
}

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

/// The device of that name, else the first one under the names of a default. Null, after a line, if
/// there is none.
standin::Device* device_named(const char* given) {
  standin::Session& session = library().session;
  if (!session.has_devices()) return nullptr;
  const std::string_view name = given != nullptr ? given : standin::kDefaultDevice;
  std::string all;
  for (standin::Device& device : session.devices) {
    if (device.settings.name == name) return &device;
    all += ", \"" + device.settings.name + '"';
  }
  if (name == standin::kDefaultDevice || name == "Default PHANToM") return &session.devices.front();
  standin::complain("libHD", std::string(name) + ": no such device; open NULL" + all);
  return nullptr;
}

/// The handle, or an error.
struct Opened {
  Handle handle = kNoDevice;
  Enum error = kDeviceFault;
};

Opened open_device(const char* name) {
  Library& lib = library();
  standin::Device* const device = device_named(name);
  if (device == nullptr) return {};
  for (const auto& touch : lib.open) {
    if (touch && &touch->device() == device) return {kNoDevice, kAlreadyOpen};
  }
  Handle handle = 0;
  while (lib.open[handle]) ++handle;  // a place is free: not all devices are open
  const bool is_locked_out = !device->claim.take();
  if (is_locked_out) {
    device->ledger.add(Row::in_use);
    standin::complain("libHD", device->settings.name + ": in use by another program");
    const standin::InUse in_use = lib.session.settings->in_use;
    if (in_use == standin::InUse::timer) return {kNoDevice, kTimer};
    if (in_use == standin::InUse::value) return {kNoDevice, kInvalidValue};
  }
  try {
    lib.open[handle].emplace(*lib.session.settings, *device, lib.errors, handle, is_locked_out);
  } catch (const std::exception& error) {
    device->claim.give_back();
    standin::complain("libHD", error.what());
    return {};
  }
  lib.open[handle]->run(lib.scheduler.runs(), lib.rate_hz);
  return {handle, kSuccess};
}

}  // namespace
}  // namespace kerf::hd

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::hd;  // NOLINT(google-build-using-namespace): the interface is global

// Devices and frames.

KERF_STAND_IN_EXPORT Handle hdInitDevice(const char* name) {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  const Opened opened = open_device(name);
  if (opened.error == kSuccess) {
    lib.current = opened.handle;
  } else {
    lib.errors.push(opened.error, kNoDevice);
  }
  return opened.handle;
}

KERF_STAND_IN_EXPORT void hdDisableDevice(Handle handle) {
  with_handle(handle, [&](Touch& device) {
    Library& lib = library();
    kerf::standin::Claim& claim = device.device().claim;
    device.close();
    lib.open[handle].reset();
    claim.give_back();  // once the connection is closed
    if (lib.current == handle) lib.current = lib.without_device();
  });
}

KERF_STAND_IN_EXPORT void hdMakeCurrentDevice(Handle handle) {
  with_handle(handle, [&](Touch&) { library().current = handle; });
}

KERF_STAND_IN_EXPORT Handle hdGetCurrentDevice() {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  return lib.current.load();
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
