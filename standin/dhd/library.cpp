// SPDX-License-Identifier: Apache-2.0
#include "standin/dhd/library.hpp"

#include <algorithm>
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

int Library::open_device(standin::Device& device) noexcept {
  std::optional<Delta>& place = open[device.number];
  if (!place) {
    if (!device.claim.take()) {
      device.ledger.add(standin::Row::in_use);
      return fail(kInUse);
    }
    try {
      place.emplace(*session.settings, device);
    } catch (const std::exception& error) {
      device.claim.give_back();
      standin::complain("libdrd", error.what());
      return fail(kNoDevice);
    }
  }
  make_default(static_cast<char>(device.number));
  return static_cast<int>(device.number);
}

int Library::open_first() noexcept {
  const std::lock_guard lock(mutex);
  if (!session.has_devices()) return fail(kNoDevice);
  for (standin::Device& device : session.devices) {
    if (!open[device.number] && !device.claim.is_with_another()) return open_device(device);
  }
  return fail(kInUse);
}

int Library::open_index(char index) noexcept {
  if (is_default(index)) return open_first();
  const std::lock_guard lock(mutex);
  if (!session.has_devices()) return fail(kNoDevice);
  const auto number = static_cast<std::size_t>(static_cast<unsigned char>(index));
  return number < session.devices.size() ? open_device(session.devices[number]) : fail(kBadIndex);
}

int Library::close(char id) noexcept {
  return with_arm(id, [&](Delta& arm) {
    standin::Device& device = arm.device();
    arm.close();
    open[device.number].reset();
    std::erase(opened_, static_cast<char>(device.number));
    device.claim.give_back();  // once the connection is closed
    return kOk;
  });
}

int Library::available() const noexcept {
  return static_cast<int>(std::ranges::count_if(session.devices, [&](const auto& device) {
    return !open[device.number] && !device.claim.is_with_another();
  }));
}

Delta* Library::find(char id) noexcept {
  if (is_default(id) && !opened_.empty()) id = opened_.back();
  const auto place = static_cast<std::size_t>(static_cast<unsigned char>(id));
  return place < open.size() && open[place] ? &*open[place] : nullptr;
}

int Library::select(char id) noexcept {
  return with_arm(id, [&](Delta& arm) {
    make_default(static_cast<char>(arm.device().number));
    return kOk;
  });
}

int Library::default_id() noexcept {
  return with_arm(-1, [](Delta& arm) { return static_cast<int>(arm.device().number); });
}

void Library::make_default(char id) {
  std::erase(opened_, id);
  opened_.push_back(id);
}

double Library::time_s() const noexcept {
  double latest_s = 0;
  for (const auto& arm : open) {
    if (arm) latest_s = std::max(latest_s, arm->time_s());
  }
  return latest_s;
}

bool Library::tick_all() noexcept {
  const std::lock_guard lock(mutex);
  bool is_needed = false;
  for (auto& arm : open) {
    if (!arm || !arm->needs_ticks()) continue;
    arm->tick();
    is_needed = true;
  }
  if (!is_needed) ticks_ = false;
  return is_needed;
}

void Library::keep_ticking() noexcept {
  if (lockstep() || ticks_.exchange(true)) return;
  const auto serve = [this] {
    constexpr std::int64_t kPeriodNs = kNsPerSecond / 1000;
    std::int64_t deadline_ns = monotonic_ns();
    do {
      deadline_ns = std::max(deadline_ns + kPeriodNs, monotonic_ns());
      sleep_until_ns(deadline_ns);
    } while (tick_all());
  };
  try {
    std::thread(serve).detach();  // the library outlives it
  } catch (const std::exception&) {
    ticks_ = false;
  }
}

}  // namespace kerf::dhd
