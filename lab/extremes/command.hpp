// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"

namespace kerf::extremes {

/// `kerf-lab extremes`: the swept contact against its limits, and beside the paper's force.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_, data_;
  std::vector<std::string> only_;
  bool quick_ = false;
  int core_ = -1, presses_ = 0, seed_ = 0;
};

}  // namespace kerf::extremes
