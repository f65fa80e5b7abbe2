// SPDX-License-Identifier: Apache-2.0
#include "controller/run/controller_options.hpp"

int main(int argc, char** argv) {
  return kerf::run_controller_program(argc, argv);
}
