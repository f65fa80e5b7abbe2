// SPDX-License-Identifier: Apache-2.0
// The window's whole way to the screen on a heap that stops who writes beside a block, drivers
// among them (visualizer/monkey/guarded_heap.cpp): on a screen that is smaller than the window,
// too.
#include <cstdlib>
#include <string>

#include <doctest/doctest.h>

#include "tests/visualizer/app/window_fixture.hpp"

using namespace kerf::test;

TEST_CASE("whatever a user does in a window, nothing is written beside a block") {
  if (!have("Xvfb")) return;
  const Screen screen;
  const std::string out = (screen.folder / "out").string();
  for (const char* sizes : {"", "--large "}) {  // 800x600 and 1100x760
    CAPTURE(sizes);
    CHECK(std::system((KERF_TEST_BIN "/kerf-visualizer-monkey --window --seed 1 --events 15 " +
                       (sizes + ("--seconds 0 --out " + out)))
                          .c_str()) == 0);
  }
}
