// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "shared/posix/program.hpp"
#include "tests/studies/study_commands.hpp"

int main(int argc, char** argv) {
  return kerf::run_program("kerf-studies",
                           [&] { return kerf::run_studies(argc, argv, std::cout, std::cerr); });
}
