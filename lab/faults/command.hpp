// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/faults/matrix.hpp"
#include "lab/rig/lab_command.hpp"

namespace kerf::faults {

/// `kerf-lab faults`: every device, rate, fault script and seed against the safety contract.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] std::vector<int> rates() const;
  [[nodiscard]] std::vector<Cell> cells() const;

  std::string scene_ = "scenes/low_limits.toml", hand_ = "scenes/hands/touch.toml";
  std::string scripts_ = "hil/faults", report_;
  std::vector<std::string> devices_, rates_{"1000"}, models_{"proxy"}, numerics_{"fixed"};
  std::uint32_t seed_base_ = 1;
  unsigned seeds_ = 20;
  unsigned random_ = 1;
};

}  // namespace kerf::faults
