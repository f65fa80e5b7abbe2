// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "lab/rig/lab_command.hpp"

namespace kerf::laws {

/// `kerf-lab law`: what laws this program knows; each tried at its extremes.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string name_;
};

}  // namespace kerf::laws
