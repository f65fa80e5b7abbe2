// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <memory>
#include <span>

#include "shared/text/command_line.hpp"

namespace kerf {

/// A subcommand of `kerf-lab` or `kerf-studies`: its options and its run. It declares its options
/// when it is made and lives as long as the program parses.
class LabCommand {
 public:
  virtual ~LabCommand() = default;
  LabCommand(const LabCommand&) = delete;
  LabCommand& operator=(const LabCommand&) = delete;

  /// After parsing.
  [[nodiscard]] bool chosen() const { return app_.chosen(); }
  /// Measures, prints each row to `out`, writes the files. Returns 1 if a check failed, 77 if this
  /// machine forbids what the command needs, else 0; some commands document further codes. Throws
  /// std::exception with one line.
  [[nodiscard]] virtual int run(std::ostream& out) const = 0;

 protected:
  LabCommand(Arguments& program, const char* name, const char* about)
      : app_(program.command(name, about)) {}

  Arguments app_;
};

/// Parses `argc` and `argv`, runs the chosen one of `commands`, and returns its exit code; 2 with
/// one line on `err`, behind the program's name, if the words or the set-up are wrong.
[[nodiscard]] int run_chosen(CommandLine& app,
                             std::span<const std::unique_ptr<LabCommand>> commands,
                             const char* program, int argc, const char* const* argv,
                             std::ostream& out, std::ostream& err);

// One factory for each command; its class is private to its source file.
[[nodiscard]] std::unique_ptr<LabCommand> make_accuracy_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_bench_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_energy_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_faults_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_impedance_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_laws_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_reproduce_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_sweep_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_zwidth_command(Arguments& program);

/// `kerf-lab`: measurements without a device. Returns the exit code: 0 fine, 2 bad input or set-up.
[[nodiscard]] int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace kerf
