// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"

namespace kerf::sweep {

/// `kerf-lab sweep`, which `./kerf sweep` is: one demo in lock-step for each combination of values,
/// on all cores, into one table. The same sweep gives the same bytes on any number of cores, and
/// goes on where it was interrupted.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string scene_;
  std::vector<std::string> set_;
  std::string device_;
  double seconds_ = 10;
  int jobs_ = 0;
  std::string out_;
};

}  // namespace kerf::sweep
