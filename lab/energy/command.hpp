// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "lab/rig/lab_command.hpp"

namespace kerf::energy {

/// `kerf-lab energy`: work of closed ways, what the stabilisers cost the hand, and the processor.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_;
  int core_ = -1;
};

}  // namespace kerf::energy
