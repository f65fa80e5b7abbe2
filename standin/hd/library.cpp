// SPDX-License-Identifier: Apache-2.0
#include "standin/hd/library.hpp"

#include <algorithm>
#include <exception>
#include <string>
#include <string_view>

namespace kerf::hd {

Library& library() {
  static auto* const kOne = new Library;  // never destroyed: see Session
  return *kOne;
}

Library::Library()
    : current(without_device()),
      scheduler({[this] { each(&Touch::begin_tick); }, [this] { each(&Touch::end_tick); }},
                *session.ledger, session.settings ? session.settings->stall_ms : 50) {
  if (!session.devices.empty()) rate_hz = session.devices.front().settings.rate_hz;
}

void Library::each(void (Touch::*what)() noexcept) noexcept {
  const std::lock_guard lock(mutex);
  for (auto& touch : open) {
    if (touch) ((*touch).*what)();
  }
}

void Library::run(bool runs) noexcept {
  const std::lock_guard lock(mutex);
  for (auto& touch : open) {
    if (touch) touch->run(runs, rate_hz);
  }
}

/// The current device if it is none that is open. A client in use runs only if it is the handle
/// that it gets later.
Handle Library::without_device() const noexcept {
  const bool is_documented = session.settings && session.settings->documented_handles;
  const bool is_any_open =
      std::ranges::any_of(open, [](const auto& touch) { return touch.has_value(); });
  return is_documented || is_any_open ? kNoDevice : kFirstDevice;
}

/// The device of that name, else the first one under the names of a default. Null, after a line, if
/// there is none.
standin::Device* Library::device_named(const char* given) noexcept {
  if (!session.has_devices()) return nullptr;
  const std::string_view name = given != nullptr ? given : standin::kHd.first_name;
  std::string all;
  for (standin::Device& device : session.devices) {
    if (device.settings.name == name) return &device;
    all += ", \"" + device.settings.name + '"';
  }
  if (name == standin::kHd.first_name || name == "Default PHANToM") return &session.devices.front();
  standin::complain("libHD", std::string(name) + ": no such device; open NULL" + all);
  return nullptr;
}

Library::Opened Library::opened(const char* name) noexcept {
  standin::Device* const device = device_named(name);
  if (device == nullptr) return {};
  for (const auto& touch : open) {
    if (touch && &touch->device() == device) return {kNoDevice, kAlreadyOpen};
  }
  Handle handle = 0;
  while (open[handle]) ++handle;  // a place is free: not all devices are open
  const bool is_locked_out = !device->claim.take();
  if (is_locked_out) {
    device->ledger.add(standin::Row::in_use);
    standin::complain("libHD", device->settings.name + ": in use by another program");
    const standin::InUse in_use = session.settings->in_use;
    if (in_use == standin::InUse::timer) return {kNoDevice, kTimer};
    if (in_use == standin::InUse::value) return {kNoDevice, kInvalidValue};
  }
  try {
    open[handle].emplace(*session.settings, *device, errors, handle, is_locked_out);
  } catch (const std::exception& error) {
    device->claim.give_back();
    standin::complain("libHD", error.what());
    return {};
  }
  open[handle]->run(scheduler.runs(), rate_hz);
  return {handle, kSuccess};
}

Handle Library::open_device(const char* name) noexcept {
  const std::lock_guard lock(mutex);
  const Opened result = opened(name);
  if (result.error == kSuccess) {
    current = result.handle;
  } else {
    errors.push(result.error, kNoDevice);
  }
  return result.handle;
}

void Library::close(Handle handle) noexcept {
  with_handle(handle, [&](Touch& touch) {
    standin::Claim& claim = touch.device().claim;
    touch.close();
    open[handle].reset();
    claim.give_back();  // once the connection is closed
    if (find(current) == nullptr) current = without_device();
  });
}

}  // namespace kerf::hd
