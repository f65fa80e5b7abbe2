// SPDX-License-Identifier: Apache-2.0
#include "lab/rig/lab_command.hpp"

#include <CLI/CLI.hpp>

namespace kerf {

LabCommand::LabCommand(CLI::App& program, const char* name, const char* about)
    : app_(program.add_subcommand(name, about)) {
  app_->footer(program.get_footer());
}

bool LabCommand::chosen() const {
  return app_->parsed();
}

}  // namespace kerf
