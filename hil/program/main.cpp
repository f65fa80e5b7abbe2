// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "hil/program/program.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/private_files.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  kerf::keep_files_private();
  const int code = kerf::run_emulator(argc, argv, kerf::catch_stop_signals(), std::cout, std::cerr);
  return kerf::when_told(code, "kerf-emulator", std::cout, std::cerr);
}
