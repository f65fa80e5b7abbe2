// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <poll.h>

#include "hil/front/serving.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf::test {

/// Lets the device serve for so long, and then until it has done what was due by then: where the
/// machine stood still all the while, it has not served at all yet.
inline void serve_for(KernelDevice& device, int milliseconds) {
  const std::int64_t until_ns = monotonic_ns() + std::int64_t{milliseconds} * 1'000'000;
  const auto owes = [&] {
    pollfd asked{device.descriptor(), POLLIN, 0};
    return device.next_wake_ns() <= until_ns || poll(&asked, 1, 0) > 0;
  };
  Histogram lateness;
  serve_kernel(
      device, [&] { return monotonic_ns() < until_ns || owes(); }, lateness);
}

}  // namespace kerf::test
