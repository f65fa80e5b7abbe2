// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "lab/rig/lab_command.hpp"

namespace kerf::accuracy {

/// `kerf-lab accuracy`: each knob of the contact force against analytic shapes.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, csv_, plot_, page_;
  int core_ = -1;
};

}  // namespace kerf::accuracy
