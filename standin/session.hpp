// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <exception>
#include <optional>
#include <string>

#include "standin/ledger.hpp"
#include "standin/settings.hpp"

#define KERF_STAND_IN_EXPORT extern "C" __attribute__((visibility("default")))

namespace kerf::standin {

/// Prints one line on the standard error, as the vendors' libraries have no other place for it.
inline void complain(const std::string& library, const std::string& line) noexcept {
  std::fprintf(stderr, "kerf stand-in %s: %s\n", library.c_str(), line.c_str());
}

/// The settings of the process and its ledger. A library has one, made at its first call and never
/// destroyed: a thread of the program may call until the very end.
struct Session {
  std::optional<Settings> settings;  ///< empty, after a line, if they cannot be read
  std::optional<Ledger> ledger;

  explicit Session(const char* library) noexcept {
    try {
      settings = settings_of_environment();
    } catch (const std::exception& error) {
      complain(library, error.what());
    }
    ledger.emplace(settings ? settings->ledger : std::string());
  }

  /// Whether the emulated device is the one that this library drives; a line if not.
  [[nodiscard]] bool is_for(Personality device, const char* library) const noexcept {
    if (!settings) return false;
    if (settings->device == device) return true;
    complain(library, "the emulated device is " + std::string(word_of(settings->device)) +
                          "; take ./kerf stand-in --device " + std::string(word_of(device)));
    return false;
  }
};

}  // namespace kerf::standin
