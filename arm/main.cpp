// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include <unistd.h>

#include "arm/run_arm.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  const int code = kerf::run_program("kerf-arm", [&] {
    return kerf::run_arm(argc, argv, kerf::catch_stop_and_pause_signals(), std::cout, std::cerr);
  });
  // The vendor's library is loaded and may have threads: what it would do at an exit can only
  // crash.
  std::cout.flush();
  _exit(code);
}
