// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"

namespace kerf::ranges {

/// `kerf-lab ranges`: what the servo does at the ends of all that can be set, judged by rule.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] int study(std::ostream& out) const;

  std::vector<std::string> numerics_, set_;
  std::string report_;
  int combinations_ = 5000, seed_ = 1, jobs_ = 0;
  double hours_ = 0;
};

}  // namespace kerf::ranges
