// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "arm/guard.hpp"
#include "arm/run_arm.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  constexpr const char* kProgram = "kerf-arm";
  return kerf::run_program(kProgram, [&] {
    return kerf::run_guarded(kProgram, [&] {
      return kerf::run_program(kProgram, [&] {
        const std::atomic<bool>& stop = kerf::catch_stop_and_pause_signals();
        return kerf::run_arm(argc, argv, stop, std::cout, std::cerr);
      });
    });
  });
}
