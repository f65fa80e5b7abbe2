// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <iostream>

#include "record/record_commands.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  kerf::make_signals_of_writes_errors();
  try {
    return kerf::run_record(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "kerf-record: " << error.what() << '\n';
    return 2;
  }
}
