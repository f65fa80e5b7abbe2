// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/tick_source.hpp"

#include <limits>
#include <stdexcept>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

namespace kerf {
namespace {

constexpr int kLookMs = 100;  // period of the checks for a stop request

}  // namespace

TickGate::TickGate(const std::string& fifo, const std::atomic<bool>& stop)
    : fd_(open(fifo.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)), stop_(stop) {
  struct stat status {};
  if (fd_ >= 0 && fstat(fd_, &status) == 0 && S_ISFIFO(status.st_mode)) return;
  if (fd_ >= 0) close(fd_);
  throw std::runtime_error("--until " + fifo + ": no FIFO; make one with mkfifo");
}

TickGate::~TickGate() {
  close(fd_);
}

void TickGate::wait_for(std::uint64_t tick) noexcept {
  for (int waited_ms = 0; tick > allowed_ && waited_ms < kPatienceMs;) {
    if (stop_.load(std::memory_order_relaxed)) return;
    pollfd fifo{fd_, POLLIN, 0};
    if (poll(&fifo, 1, kLookMs) <= 0) {
      waited_ms += kLookMs;
    } else if (read(fd_, &allowed_, sizeof allowed_) != sizeof allowed_) {
      break;  // the writer has gone; eight bytes come whole, or not at all
    }
  }
  if (tick > allowed_) allowed_ = std::numeric_limits<std::uint64_t>::max();
}

}  // namespace kerf
