// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "controller/volume_tool/volume_commands.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  kerf::make_signals_of_writes_errors();
  return kerf::run_program("kerf-volume",
                           [&] { return kerf::run_volume_tool(argc, argv, std::cout, std::cerr); });
}
