// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "visualizer/panels/overlay.hpp"

using namespace kerf;

TEST_CASE("the plot holds the last five seconds, and each record once") {
  ForcePlot plot;
  TickRecord record{};
  for (int i = 1; i <= 800; ++i) {
    record.start_ns = static_cast<std::uint64_t>(i) * 10'000'000;
    record.commanded_force_n[0] = 0.3F;
    record.commanded_force_n[1] = 0.4F;
    record.penetration_mm = static_cast<float>(i);
    plot.add(record);
    plot.add(record);
  }
  REQUIRE(plot.points().size() == 501);
  CHECK(plot.points().front().time_ns == 3'000'000'000);
  CHECK(plot.points().front().penetration_mm == 300.0F);
  CHECK(plot.points().back().penetration_mm == 800.0F);
  CHECK(plot.points().back().force_n == doctest::Approx(0.5));

  record.start_ns = 1;  // of the past
  plot.add(record);
  CHECK(plot.points().size() == 501);

  record.start_ns = 60'000'000'000;  // after a long pause
  plot.add(record);
  CHECK(plot.points().size() == 1);
}
