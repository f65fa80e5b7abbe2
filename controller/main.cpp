// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "controller/shell/controller_run.hpp"
#include "controller/shell/probe/probe.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/private_files.hpp"

int main(int argc, char** argv) {
  kerf::keep_files_private();
  try {
    kerf::ControllerOptions options;
    if (const auto code = kerf::parse_options(argc, argv, options)) return *code;
    return options.probe ? kerf::run_probe(options) : kerf::run_controller(options);
  } catch (...) {
    std::cerr << "kerf-controller: " << kerf::failure_text() << '\n';
    return 2;
  }
}
