// SPDX-License-Identifier: Apache-2.0
#include "lab/rig/lab_command.hpp"

namespace kerf {

LabCommand::LabCommand(Arguments& program, const char* name, const char* about)
    : app_(program.command(name, about)) {}

bool LabCommand::chosen() const {
  return app_.chosen();
}

}  // namespace kerf
