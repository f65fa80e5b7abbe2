// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <mutex>
#include <optional>

#include "standin/hd/error_stack.hpp"
#include "standin/hd/numbers.hpp"
#include "standin/hd/scheduler.hpp"
#include "standin/hd/touch.hpp"
#include "standin/session.hpp"

/// The state of the HD stand-in: devices by handle, the current one, errors, the servo thread.
namespace kerf::hd {

/// All state of the library. `mutex` guards the devices; no callback runs while it is held.
struct Library {
  standin::Session session{"libHD", standin::kHd.personality};
  ErrorStack errors;
  std::recursive_mutex mutex;
  std::array<std::optional<Touch>, standin::kMostDevices> open;  ///< by handle
  std::atomic<Handle> current;
  int rate_hz = 1000;
  Scheduler scheduler;

  Library();
  /// The device of that name, or of the default one; its handle becomes the current device. The
  /// result is kNoDevice, after an error, if there is none to open.
  [[nodiscard]] Handle open_device(const char* name) noexcept;
  void close(Handle handle) noexcept;
  /// The scheduler starts or stops.
  void run(bool runs) noexcept;
  /// Null if there is none.
  [[nodiscard]] Touch* find(Handle handle) noexcept {
    return handle < open.size() && open[handle] ? &*open[handle] : nullptr;
  }
  [[nodiscard]] bool lockstep() const noexcept { return session.lockstep(); }
  [[nodiscard]] int priority() const noexcept {
    return session.settings ? session.settings->priority : 0;
  }
  void refuse(Enum code) noexcept { errors.push(code, current); }

 private:
  /// The handle, or an error.
  struct Opened {
    Handle handle = kNoDevice;
    Enum error = kDeviceFault;
  };
  [[nodiscard]] Opened opened(const char* name) noexcept;
  [[nodiscard]] standin::Device* device_named(const char* name) noexcept;
  [[nodiscard]] Handle without_device() const noexcept;
  void each(void (Touch::*what)() noexcept) noexcept;
};

[[nodiscard]] Library& library();

/// Calls `use(device)` under the lock; without that device an error, and `otherwise`.
template <class Result, class Use>
Result with_handle(Handle handle, Result otherwise, const Use& use) {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  if (Touch* const touch = lib.find(handle)) return use(*touch);
  lib.session.ledger->add(standin::Row::bad_handles);
  lib.errors.push(kBadHandle, handle);
  return otherwise;
}
template <class Use>
void with_handle(Handle handle, const Use& use) {
  with_handle(handle, 0, [&](Touch& device) { return use(device), 0; });
}

/// Calls `use` with the current device.
template <class Result, class Use>
Result with_device(Result otherwise, const Use& use) {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  return with_handle(lib.current, otherwise, use);
}

}  // namespace kerf::hd
