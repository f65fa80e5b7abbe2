// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "visualizer/app/window_keys.hpp"
#include "visualizer/panels/overlay.hpp"

using namespace kerf;

namespace {

/// The banner of a picture at `now`.
OverlayFigures shown(const Notices& notices, Notices::Clock::time_point now, bool hidden = false) {
  OverlayFigures figures;
  figures.banner = "stale";
  figures.hidden = hidden;
  notices.show(figures, now);
  return figures;
}

}  // namespace

TEST_CASE("the last notice takes the banner for a while, then what was there is back") {
  const Notices::Clock::time_point start{};
  const auto later = start + std::chrono::hours(1);
  Notices notices;
  CHECK(shown(notices, later).banner == "stale");
  notices.say({"screenshot: a.png"}, later);
  notices.say({"screenshot: b.png"}, later);
  CHECK(shown(notices, later).banner == "screenshot: b.png");
  CHECK_FALSE(shown(notices, later).alarm);
  CHECK(shown(notices, later + Notices::kShownFor).banner == "stale");
  notices.clear();
  CHECK(shown(notices, later).banner == "stale");
}

TEST_CASE("with the panels hidden a notice shows only where it is a problem") {
  const auto now = Notices::Clock::time_point{} + std::chrono::hours(1);
  Notices notices;
  notices.say({"surface: a.ply"}, now);
  CHECK(shown(notices, now, true).banner == "stale");
  notices.say({"a.ply: no room", true}, now);
  CHECK(shown(notices, now, true).banner == "a.ply: no room");
  CHECK(shown(notices, now, true).alarm);
}

TEST_CASE("a panel that is asked for brings the hidden ones back") {
  WindowKeys keys;
  keys.switch_panel(keys.slices, keys.plot);
  CHECK(keys.slices);
  keys.hidden = true;
  keys.switch_panel(keys.slices, keys.plot);
  CHECK(keys.slices);  // it was not seen
  CHECK_FALSE(keys.hidden);
  keys.switch_panel(keys.slices, keys.plot);
  CHECK_FALSE(keys.slices);
  keys.slices = keys.hidden = true;
  keys.switch_panel(keys.plot, keys.slices);
  CHECK(keys.plot);
  CHECK_FALSE(keys.slices);
  CHECK_FALSE(keys.hidden);
}

TEST_CASE("a tool that a scene lacks is told with the keys that it has") {
  CHECK(no_such_tool(6, 3) == "tool 7: the scene has 3; press 1 to 3");
  CHECK(no_such_tool(1, 1) == "tool 2: the scene has 1; press 1");
}
