// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "shared/posix/monotonic_clock.hpp"
#include "standin/dhd/delta.hpp"
#include "standin/dhd/numbers.hpp"
#include "standin/session.hpp"

/// The state of the dhd/drd stand-in: devices by ID, the error of each thread.
namespace kerf::dhd {

/// The error of the calling thread. Returns kFailed.
int fail(int code) noexcept;
[[nodiscard]] int last_error() noexcept;
/// Never null.
[[nodiscard]] const char* text_of(int code) noexcept;

struct Library {
  standin::Session session{"libdrd", standin::kDhd.personality};
  std::recursive_mutex mutex;                                    ///< guards the devices
  std::array<std::optional<Delta>, standin::kMostDevices> open;  ///< by ID: the device's number
  std::atomic<bool> is_expert{false};                            ///< of the whole process

  /// The first device that no program has open. Each open: the ID, which becomes the default one;
  /// or kFailed.
  int open_first() noexcept;
  /// A device by its number, also one that this program has open; -1: the first.
  int open_index(char index) noexcept;
  int close(char id) noexcept;
  /// Devices that no program has open.
  [[nodiscard]] int available() const noexcept;

  /// -1 stands for the default device: the one that was opened or selected last and is still open.
  /// Null if there is none.
  [[nodiscard]] Delta* find(char id) noexcept;
  /// Makes it the default one.
  int select(char id) noexcept;
  [[nodiscard]] int default_id() noexcept;

  [[nodiscard]] bool lockstep() const noexcept { return session.lockstep(); }
  /// In lock-step: time of the device that is ahead of the others, s.
  [[nodiscard]] double time_s() const noexcept;
  /// Lets the watchdogs and the regulators run from now on, in real time.
  void keep_ticking() noexcept;

 private:
  int open_device(standin::Device& device) noexcept;
  void make_default(char id);
  [[nodiscard]] bool tick_all() noexcept;

  std::vector<char> opened_;  ///< IDs, the default one last
  std::atomic<bool> ticks_{false};
};

[[nodiscard]] Library& library();
[[nodiscard]] constexpr bool is_default(char id) noexcept {
  return id == static_cast<char>(-1);
}

/// Calls `use(device)`, whose result it returns, under the lock; kFailed and an error if no such
/// device is open.
template <class Use>
int with_arm(char id, const Use& use) noexcept {
  Library& lib = library();
  const std::lock_guard lock(lib.mutex);
  if (Delta* const arm = lib.find(id)) return use(*arm);
  lib.session.ledger->add(standin::Row::bad_handles);
  return fail(kNoDevice);
}

/// As `with_arm` for a force command: in real time it first waits for a slot of the device.
template <class Use>
int with_slot(char id, const Use& use) noexcept {
  std::int64_t slot_ns = 0;
  const int found = with_arm(id, [&](Delta& arm) {
    slot_ns = arm.take_slot_ns();
    return kOk;
  });
  if (found != kOk) return found;
  if (slot_ns > 0) sleep_until_ns(slot_ns);  // without the lock
  return with_arm(id, use);
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
