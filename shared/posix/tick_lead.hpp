// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "shared/posix/stop_signals.hpp"

namespace kerf {

/// Leads a controller in lock-step: writes into its FIFO (`--until`) how far it may go. Never
/// waits: a controller that does not read yet is written to again. One thread.
class TickLead {
 public:
  explicit TickLead(std::string fifo) noexcept : fifo_(std::move(fifo)) {
    make_signals_of_writes_errors();
  }
  ~TickLead() {
    if (fd_ >= 0) close(fd_);
  }
  TickLead(const TickLead&) = delete;
  TickLead& operator=(const TickLead&) = delete;

  /// Why `fifo` leads no controller, for a message; or empty.
  [[nodiscard]] static std::string problem_with(const std::filesystem::path& fifo) {
    std::error_code fault;
    if (std::filesystem::is_fifo(fifo, fault)) return {};
    return "--lead " + fifo.string() + ": no FIFO; make one with mkfifo";
  }

  /// Ticks up to this one may run. Call it as often as the run is looked at.
  void allow(std::uint64_t tick) noexcept {
    // ENXIO while there is no reader.
    if (fd_ < 0) fd_ = open(fifo_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0 || tick <= told_) return;
    if (write(fd_, &tick, sizeof tick) == sizeof tick) told_ = tick;
  }

 private:
  std::string fifo_;
  int fd_ = -1;
  std::uint64_t told_ = 0;
};

}  // namespace kerf
