// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "lab/rig/lab_command.hpp"

namespace kerf {

/// `kerf-lab bench`: the servo's kernels against the paper's form.
class BenchCommand final : public LabCommand {
 public:
  explicit BenchCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string report_, page_;
  int core_ = -1;
};

}  // namespace kerf
