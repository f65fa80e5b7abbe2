// SPDX-License-Identifier: Apache-2.0
#include "standin/dhd/library.hpp"

#include <array>
#include <exception>
#include <thread>

#include "shared/posix/monotonic_clock.hpp"

namespace kerf::dhd {
namespace {

thread_local int error_of_thread = kNoError;

constexpr std::array<const char*, kErrors> kTexts{"no error",
                                                  "unknown error",
                                                  "the connection to the device failed",
                                                  "the device is busy",
                                                  "no driver",
                                                  "no device",
                                                  "the device has no such part",
                                                  "time is over",
                                                  "the pose cannot be computed",
                                                  "only in expert mode",
                                                  "not part of the kerf stand-in",
                                                  "no memory",
                                                  "the device is not ready",
                                                  "no such file",
                                                  "the configuration is wrong",
                                                  "no such index",
                                                  "no longer supported",
                                                  "an argument is missing",
                                                  "redundant encoders disagree",
                                                  "not enabled",
                                                  "the device is in use",
                                                  "an argument is out of range",
                                                  "no regulation runs"};

}  // namespace

int fail(int code) noexcept {
  error_of_thread = code;
  return kFailed;
}

int last_error() noexcept {
  return error_of_thread;
}

const char* text_of(int code) noexcept {
  return code >= 0 && code < kErrors ? kTexts[static_cast<std::size_t>(code)] : kTexts[kError];
}

Library& library() {
  static auto* const kOne = new Library;  // never destroyed: see Session
  return *kOne;
}

int Library::open() noexcept {
  const std::lock_guard lock(mutex);
  if (device) return 0;
  try {
    if (!session.is_for(Personality::omega, "libdrd")) return fail(kNoDevice);
    device.emplace(*session.settings, *session.ledger);
    return 0;
  } catch (const std::exception& error) {
    standin::complain("libdrd", error.what());
  }
  return fail(kNoDevice);
}

int Library::close() noexcept {
  const std::lock_guard lock(mutex);
  device->close();
  device.reset();
  return kOk;
}

void Library::pace() noexcept {
  if (!session.settings || lockstep()) return;
  const std::int64_t period_ns = kNsPerSecond / session.settings->rate_hz;
  const std::int64_t now_ns = monotonic_ns();
  std::int64_t slot_ns = next_slot_ns_;
  if (slot_ns > now_ns) sleep_until_ns(slot_ns);
  next_slot_ns_ = std::max(slot_ns, now_ns) + period_ns;
}

void Library::keep_ticking() noexcept {
  if (lockstep() || ticks_.exchange(true)) return;
  const auto serve = [this] {
    constexpr std::int64_t kPeriodNs = kNsPerSecond / 1000;
    for (std::int64_t deadline_ns = monotonic_ns();;) {
      deadline_ns = std::max(deadline_ns + kPeriodNs, monotonic_ns());
      sleep_until_ns(deadline_ns);
      const std::lock_guard lock(mutex);
      if (!device || !device->needs_ticks()) {
        ticks_ = false;
        return;
      }
      device->tick();
    }
  };
  try {
    std::thread(serve).detach();  // the library outlives it
  } catch (const std::exception&) {
    ticks_ = false;
  }
}

}  // namespace kerf::dhd
