// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>

#include "lab/bridge/link.hpp"
#include "lab/rig/lab_command.hpp"

namespace kerf::two_machines {

/// `kerf-lab two-machines`, which `./kerf demo --two-machines` is: controller, emulated device and
/// `kerf-bridge serve` on one machine, `join` and the visualizer on another, both of them network
/// namespaces of this one.
class DemoCommand final : public LabCommand {
 public:
  explicit DemoCommand(Arguments& program);
  /// The controller's exit code, 1 where the picture never came, 77 where this machine forbids
  /// network namespaces.
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string scene_;
  double seconds_ = 10;
  double loss_percent_ = 0, delay_ms_ = 0, mbit_ = 0;
  std::string size_;
  std::string out_;
};

}  // namespace kerf::two_machines
