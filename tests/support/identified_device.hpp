// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf::test {

/// What `kerf identify` writes: an arm that is anisotropic, 1.8 ms late, with intervals.
inline const std::string kDeviceFile =
    "[device]\nmass_kg = [0.032, 0.053, 0.077, 0.01, -0.022, 0.005]\n"
    "viscous_ns_per_mm = [0.0004, 0.0005, 0.0006]\ncoulomb_n = [0.1, 0.2, 0.3]\n"
    "quantum_mm = [0.03, 0.03, 0.04]\ndelay_s = 0.0018\nrate_hz = 1000\n"
    "[low]\nviscous_ns_per_mm = [0.0003, -0.0001, 0.0005]\ncoulomb_n = [0.05, 0.1, 0.2]\n"
    "delay_s = 0.0017\n[high]\ndelay_s = 0.0019\n[fit]\n";

/// It with one text in place of another.
inline std::string device_file_with(const std::string& from, const std::string& to) {
  std::string text = kDeviceFile;
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace kerf::test
