// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <exception>
#include <iostream>

#include "record/record_commands.hpp"

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit is an error of write, not a death
  try {
    return kerf::run_record(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "kerf-record: " << error.what() << '\n';
    return 2;
  }
}
