// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "shared/text/command_line.hpp"

namespace kerf {

/// A subcommand of `kerf-lab`: its options, and the run. Lives as long as the program parses.
class LabCommand {
 public:
  virtual ~LabCommand() = default;
  LabCommand(const LabCommand&) = delete;
  LabCommand& operator=(const LabCommand&) = delete;

  /// After parsing.
  [[nodiscard]] bool chosen() const { return app_.chosen(); }
  /// Measures, tells each row on `out`, writes the files. Returns 1 where a check failed, else 0.
  /// Throws std::exception with one line.
  [[nodiscard]] virtual int run(std::ostream& out) const = 0;

 protected:
  LabCommand(Arguments& program, const char* name, const char* about)
      : app_(program.command(name, about)) {}

  Arguments app_;
};

}  // namespace kerf
