// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <iostream>

#include "controller/shell/controller_run.hpp"
#include "controller/shell/probe/probe.hpp"

int main(int argc, char** argv) {
  kerf::ControllerOptions options;
  if (const auto code = kerf::parse_options(argc, argv, options)) return *code;
  try {
    return options.probe ? kerf::run_probe(options) : kerf::run_controller(options);
  } catch (const std::exception& error) {
    std::cerr << "kerf-controller: " << error.what() << '\n';
    return 2;
  }
}
