// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "hil/program/emulator_options.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  return kerf::run_program("kerf-emulator", [&] {
    return kerf::run_emulator(argc, argv, kerf::catch_stop_signals(), std::cout, std::cerr);
  });
}
