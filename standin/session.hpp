// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <exception>
#include <optional>
#include <string>
#include <string_view>

#include "standin/claim.hpp"
#include "standin/ledger.hpp"
#include "standin/settings.hpp"

#define KERF_STAND_IN_EXPORT extern "C" __attribute__((visibility("default")))

namespace kerf::standin {

/// Prints one line on the standard error, as the vendors' libraries have no other place for it.
/// Control characters and bytes that are no UTF-8, which a program's name of a device may have, are
/// written as in C.
void complain(const std::string& library, std::string_view line) noexcept;

/// A device that the library may open: its settings, its counts, and the right to use it.
struct Device {
  std::size_t number;  ///< among those of its kind, from 0
  const DeviceSettings& settings;
  Ledger ledger;
  Claim claim;

  Device(std::size_t its_number, const DeviceSettings& its)
      : number(its_number), settings(its), ledger(its.ledger), claim(its.socket + ".claim") {}
};

/// The settings of the process, the devices of the library's kind, and the ledger of what belongs
/// to no device. A library has one, made at its first call and never destroyed: a thread of the
/// program may call until the very end.
struct Session {
  const char* library;
  Personality kind;
  std::optional<Settings> settings;  ///< empty, after a line, if they cannot be read
  std::optional<Ledger> ledger;
  std::deque<Device> devices;  ///< by their numbers

  Session(const char* name, Personality its_kind) noexcept : library(name), kind(its_kind) {
    try {
      settings = settings_of_environment();
    } catch (const std::exception& error) {
      complain(library, error.what());
    }
    ledger.emplace(settings ? settings->ledger : std::string());
    if (!settings) return;
    for (const DeviceSettings& device : settings->devices) {
      if (device.kind == kind) devices.emplace_back(devices.size(), device);
    }
  }

  /// Whether an emulated device is one that this library drives; a line if not.
  [[nodiscard]] bool has_devices() const noexcept {
    if (settings && devices.empty()) {
      complain(library, "the emulated device is " +
                            std::string(word_of(settings->devices.front().kind)) +
                            "; take ./kerf stand-in --device " + std::string(word_of(kind)));
    }
    return !devices.empty();
  }
  [[nodiscard]] bool lockstep() const noexcept { return settings && settings->lockstep; }
};

}  // namespace kerf::standin
