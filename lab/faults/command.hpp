// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"

namespace kerf::faults {

/// `kerf-lab faults`: every device, every fault script and every seed against the safety contract.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string scene_ = "scenes/touch.toml", hand_ = "scenes/hands/touch.toml";
  std::string scripts_ = "hil/faults", report_;
  std::vector<std::string> devices_;
  unsigned seeds_ = 20;
  unsigned random_ = 1;
  int rate_hz_ = 1000;
};

}  // namespace kerf::faults
