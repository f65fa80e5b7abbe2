// SPDX-License-Identifier: Apache-2.0
#include "controller/program.hpp"

#include <iostream>

#include "controller/shell/controller_run.hpp"
#include "controller/shell/probe/probe.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/private_files.hpp"

namespace kerf {

int run_controller_program(int argc, char** argv) {
  keep_files_private();
  try {
    ControllerOptions options;
    const auto early = parse_options(argc, argv, options);
    const int code = early ? *early : options.probe ? run_probe(options) : run_controller(options);
    return when_told(code, "kerf-controller", std::cout, std::cerr);
  } catch (...) {
    std::cerr << "kerf-controller: " << failure_text() << '\n';
    return 2;
  }
}

}  // namespace kerf
