// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"
#include "lab/zwidth/results.hpp"

namespace kerf::zwidth {

/// `kerf-lab merge`: the parts of a map's shards as one map.
class MergeCommand final : public LabCommand {
 public:
  explicit MergeCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::vector<std::string> parts_;
  OutputPaths paths_;
};

}  // namespace kerf::zwidth
