// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <ostream>

#include "lab/run/lab_command.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/text/command_line.hpp"

namespace kerf {

int run_chosen(CommandLine& app, std::span<const std::unique_ptr<LabCommand>> commands,
               const char* program, int argc, const char* const* argv, std::ostream& out,
               std::ostream& err) {
  try {
    int code = 0;
    if (app.parse(argc, argv, out)) {
      for (const auto& command : commands) {
        if (command->chosen()) code = command->run(out);
      }
    }
    return code;
  } catch (...) {
    err << program << ": " << failure_text() << '\n';
    return 2;
  }
}

int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CommandLine app("Measures kerf without a device.", "kerf-lab", "kerf-lab " KERF_VERSION);
  app.footer("Exit codes: 0 fine, 1 a check failed, 2 bad input or set-up.");
  const std::array commands{
      make_zwidth_command(app), make_impedance_command(app), make_sweep_command(app),
      make_faults_command(app), make_accuracy_command(app),  make_energy_command(app),
      make_laws_command(app),   make_bench_command(app),     make_reproduce_command(app),
  };
  return run_chosen(app, commands, "kerf-lab", argc, argv, out, err);
}

}  // namespace kerf
