// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace kerf {

/// Leads a controller in lock-step from picture to picture: says into its FIFO (`--until`) how far
/// it may go. Never waits: a controller that does not listen yet is told again.
class TickLead {
 public:
  explicit TickLead(std::string fifo) noexcept;
  ~TickLead();
  TickLead(const TickLead&) = delete;
  TickLead& operator=(const TickLead&) = delete;

  /// Ticks up to this one may run. Call it as often as the picture is looked at.
  void allow(std::uint64_t tick) noexcept;

 private:
  std::string fifo_;
  int fd_ = -1;
  std::uint64_t told_ = 0;
};

}  // namespace kerf
