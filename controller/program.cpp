// SPDX-License-Identifier: Apache-2.0
#include "controller/program.hpp"

#include "controller/shell/controller_run.hpp"
#include "controller/shell/probe/probe.hpp"
#include "shared/posix/program.hpp"

namespace kerf {

int run_controller_program(int argc, char** argv) {
  return run_program("kerf-controller", [&] {
    ControllerOptions options;
    const auto early = parse_options(argc, argv, options);
    return early ? *early : options.probe ? run_probe(options) : run_controller(options);
  });
}

}  // namespace kerf
