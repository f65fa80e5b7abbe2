// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stdexcept>
#include <string>

#include "arm/inverse3/messages.hpp"
#include "arm/inverse3/web_socket.hpp"

// What the HTTP answers of a service mean, with the way out.

namespace kerf::inverse3 {

inline constexpr const char* kNeeds =
    "needs the vendor's Inverse Service 3.1 or newer: systemctl status haply-inverse-service";

/// A reason for which no later try can help.
struct Refusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws for an answer whose status is no success, with the remedy of that status: a Refusal, or
/// std::runtime_error if a later try may meet another answer (503, in use). `who` begins the text.
[[noreturn]] void throw_status(const std::string& who, const HttpAnswer& answer);

/// The answer to /version.
struct ServiceVersion {
  std::string text;  ///< "3.5.0.0"
  ForceKey key{};
  /// Turns a second of kerf's emulated service in lock-step; 0: by the clock, as every real one.
  int lockstep_hz = 0;
};
/// Throws as `throw_status`; a Refusal if the answer has no version, or one before 3.1.
[[nodiscard]] ServiceVersion version_in(const HttpAnswer& answer);

/// The answer to /settings/devices/force_scale; empty if it has none.
[[nodiscard]] std::optional<double> force_scale_of(const HttpAnswer& answer);

}  // namespace kerf::inverse3
