// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "controller/volume_tool/volume_commands.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/private_files.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  kerf::keep_files_private();
  kerf::make_signals_of_writes_errors();
  const int code = kerf::run_volume_tool(argc, argv, std::cout, std::cerr);
  return kerf::when_told(code, "kerf-volume", std::cout, std::cerr);
}
