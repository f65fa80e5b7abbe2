// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/frame_report.hpp"

#include <doctest/doctest.h>

using namespace kerf;

TEST_CASE("the stopwatch counts processor time while the process works") {
  const Stopwatch watch;
  volatile double sum = 0.0;
  while (watch.cpu_ms() < 5.0) sum = sum + 1.0;
  CHECK(watch.wall_ms() > 0.0);
  CHECK(watch.cpu_ms() >= 5.0);
}
