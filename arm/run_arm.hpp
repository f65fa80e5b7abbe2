// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <iosfwd>
#include <optional>
#include <string>

#include "shared/wire/personality.hpp"

namespace kerf {

/// The command line of kerf-arm.
struct ArmOptions {
  std::string device;
  Personality personality{};
  std::string name;     ///< of the page; empty: that of the device
  std::string library;  ///< empty: the loader searches
  std::string vendor_name = "Default Device";
  bool no_vendor_name = false;
  int index = -1;
  int rate_hz = 0;  ///< 0: touch: the library's own; omega: 4000
  bool auto_init = false;
  std::string service;               ///< [HOST:]PORT; empty: that of this machine
  int events = -1;                   ///< port of its events; 0: none; -1: the usual one
  std::string park, arm_id, handle;  ///< as in inverse3::Wanted
  bool once = false;                 ///< end with the first controller
  std::optional<double> peak_n;      ///< omega: limit below the device's own
  int priority = 81;
  int cpu = -1;
  int stall_ms = 100;
  double opening_s = 10;
  std::optional<double> seconds;
  std::string report;
};

/// `kerf-arm`: opens a device through its vendor's library or service and exchanges poses and
/// forces with a controller through a shared page, until `stop`. While there is no controller, the
/// force is zero and the device stays open. In lock-step it serves one controller, as with
/// `--once`.
///
/// Returns the exit code: 0 after a requested end; 2, with one line on `err`, after bad input or a
/// failure of the library, service or device.
[[nodiscard]] int run_arm(int argc, const char* const* argv, const std::atomic<bool>& stop,
                          std::ostream& out, std::ostream& err);

}  // namespace kerf
