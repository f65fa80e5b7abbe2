// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/tick_lead.hpp"

#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "shared/posix/stop_signals.hpp"

namespace kerf {

TickLead::TickLead(std::string fifo) noexcept : fifo_(std::move(fifo)) {
  make_signals_of_writes_errors();
}

TickLead::~TickLead() {
  if (fd_ >= 0) close(fd_);
}

void TickLead::allow(std::uint64_t tick) noexcept {
  // ENXIO while nobody reads.
  if (fd_ < 0) fd_ = open(fifo_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0 || tick <= told_) return;
  if (write(fd_, &tick, sizeof tick) == sizeof tick) told_ = tick;
}

}  // namespace kerf
