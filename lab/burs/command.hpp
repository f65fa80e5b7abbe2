// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>

#include "lab/rig/lab_command.hpp"

namespace kerf::burs {

/// `kerf-lab burs`: the heads that a scene can name by their ISO number, and a drawing of them.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string svg_;
};

}  // namespace kerf::burs
