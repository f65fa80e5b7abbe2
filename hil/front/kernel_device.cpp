// SPDX-License-Identifier: Apache-2.0
#include "hil/front/kernel_device.hpp"

#include <algorithm>
#include <ctime>

#include <poll.h>

#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kStopCheckNs = 100'000'000;

}  // namespace

void serve_kernel(KernelDevice& device, const std::function<bool()>& goes_on, Histogram& lateness) {
  while (goes_on()) {
    const std::int64_t late_ns = monotonic_ns() - device.next_wake_ns();
    if (late_ns >= 0) {
      lateness.record(late_ns);
      device.wake();
    }
    const std::int64_t patience_ns =
        std::clamp<std::int64_t>(device.next_wake_ns() - monotonic_ns(), 0, kStopCheckNs);
    const timespec patience{0, patience_ns};
    pollfd asked{device.descriptor(), POLLIN, 0};
    if (ppoll(&asked, 1, &patience, nullptr) > 0) device.answer();
  }
}

}  // namespace kerf
