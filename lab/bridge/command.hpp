// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>

#include "lab/rig/lab_command.hpp"

namespace kerf::two_machines {

/// `kerf-lab bridge`, which `./kerf bench bridge` is: how late the picture on a second machine is,
/// over links that lose, delay and throttle packets, and what it costs.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  /// 77 where this machine forbids network namespaces.
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  double seconds_ = 15;
  std::uint64_t seed_ = 1;
  bool quick_ = false;
  std::string only_, link_;
  std::string page_;
};

}  // namespace kerf::two_machines
