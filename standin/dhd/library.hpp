// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include "standin/dhd/delta.hpp"
#include "standin/dhd/numbers.hpp"
#include "standin/session.hpp"

/// The state of the dhd/drd stand-in: one device under ID 0, the error of each thread.
namespace kerf::dhd {

/// The error of the calling thread. Returns kFailed.
int fail(int code) noexcept;
[[nodiscard]] int last_error() noexcept;
/// Never null.
[[nodiscard]] const char* text_of(int code) noexcept;

struct Library {
  standin::Session session{"libdrd"};
  std::recursive_mutex mutex;  ///< guards the device
  std::optional<Delta> device;
  std::atomic<bool> is_expert{false};  ///< of the whole process

  /// Opens the device unless it is open, and returns its ID, 0; else kFailed.
  int open() noexcept;
  int close() noexcept;
  [[nodiscard]] bool lockstep() const noexcept {
    return session.settings && session.settings->lockstep;
  }
  /// Waits for the slot of the next force command, in real time.
  void pace() noexcept;
  /// Lets the watchdog and the regulator run from now on, in real time.
  void keep_ticking() noexcept;

 private:
  std::atomic<std::int64_t> next_slot_ns_{0};
  std::atomic<bool> ticks_{false};
};

[[nodiscard]] Library& library();

/// Calls `use(device)`, whose result it returns, under the lock; kFailed and an error without an
/// open device, or for another ID. -1 stands for the default device.
template <class Use>
int with_arm(char id, const Use& use) noexcept {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  if (lib.device && (id == 0 || id == static_cast<char>(-1))) return use(*lib.device);
  lib.session.ledger->add(standin::Row::bad_handles);
  return fail(kNoDevice);
}

/// As `with_arm` with a pose that has just been read; its result is that of the reading.
template <class Use>
int with_pose(char id, const Use& use) noexcept {
  return with_arm(id, [&](Delta& arm) {
    const int result = arm.read();
    if (result < 0) return fail(kCommunication);
    const int used = use(arm);
    return used < 0 ? used : result;
  });
}

/// Writes unless `out` is null.
template <class T>
void give(T* out, T value) noexcept {
  if (out != nullptr) *out = value;
}
inline void give(const std::array<double, 3>& v, double* x, double* y, double* z) noexcept {
  give(x, v[0]);
  give(y, v[1]);
  give(z, v[2]);
}

}  // namespace kerf::dhd
