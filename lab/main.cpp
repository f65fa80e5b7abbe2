// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "lab/run/lab_command.hpp"
#include "shared/posix/program.hpp"

int main(int argc, char** argv) {
  return kerf::run_program("kerf-lab",
                           [&] { return kerf::run_lab(argc, argv, std::cout, std::cerr); });
}
