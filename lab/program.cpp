// SPDX-License-Identifier: Apache-2.0
#include "lab/program.hpp"

#include <array>
#include <ostream>

#include <CLI/CLI.hpp>

#include "hil/hil_error.hpp"
#include "lab/accuracy/command.hpp"
#include "lab/bench/bench_command.hpp"
#include "lab/extremes/command.hpp"
#include "lab/faults/command.hpp"

namespace kerf {

int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CLI::App app{"Measures kerf without a device.", "kerf-lab"};
  app.set_version_flag("--version", "kerf-lab " KERF_VERSION);
  app.footer("Exit codes: 0 fine, 1 a check failed, 2 bad input or set-up.");
  app.require_subcommand(1);
  const BenchCommand bench(app);
  const accuracy::Command accuracy(app);
  const extremes::Command extremes(app);
  const faults::Command faults(app);
  const std::array<const LabCommand*, 4> commands{&bench, &accuracy, &extremes, &faults};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, err) == 0 ? 0 : 2;
  }
  try {
    for (const LabCommand* command : commands) {
      if (command->chosen()) return command->run(out);
    }
  } catch (const HilError& error) {
    err << "kerf-lab: " << error.what() << '\n';
    return 2;
  }
  return 0;
}

}  // namespace kerf
