// SPDX-License-Identifier: Apache-2.0
#include <chrono>

#include <doctest/doctest.h>

#include "visualizer/panels/overlay.hpp"

using namespace kerf;
using namespace std::chrono_literals;

TEST_CASE("rates and age change four times a second, whatever comes in each frame") {
  ShownRates rates;
  OverlayFigures before;
  int changes = 0;
  for (int frame = 0; frame < 100; ++frame) {  // two seconds
    OverlayFigures figures;
    figures.tick_rate_hz = 1000.0 + frame;
    figures.data_age_ms = 0.1 * frame;
    rates.show(figures, ShownRates::Clock::time_point(frame * 20ms));
    if (frame > 0 && figures != before) ++changes;
    before = figures;
  }
  CHECK(changes == 7);  // 0.26 s, 0.52 s ... 1.82 s
  REQUIRE(before.frame_rate_hz);
  CHECK(*before.frame_rate_hz == doctest::Approx(50.0));
}

TEST_CASE("the age of data that come no more goes with its next change") {
  ShownRates rates;
  OverlayFigures figures;
  figures.data_age_ms = 3.0;
  rates.show(figures, ShownRates::Clock::time_point(1s));
  figures.data_age_ms.reset();
  rates.show(figures, ShownRates::Clock::time_point(1s + ShownRates::kHold));
  CHECK_FALSE(figures.data_age_ms);
}
