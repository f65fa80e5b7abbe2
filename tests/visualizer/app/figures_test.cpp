// SPDX-License-Identifier: Apache-2.0
// Notices, rates and the plot of the panels.
#include <chrono>

#include <doctest/doctest.h>

#include "visualizer/app/window_keys.hpp"
#include "visualizer/panels/overlay.hpp"

namespace kerf::figures_test {

using namespace std::chrono_literals;

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

TEST_CASE("an undo that is not possible is refused with the one reason that holds") {
  const auto at = [](std::uint32_t flags) {
    TickRecord tick{};
    tick.flags = flags;
    return std::optional(tick);
  };
  constexpr bool kRemoved = true, kCutBefore = true;
  const auto has = [](const std::string& reason, const char* words) {
    CAPTURE(reason);
    CHECK(reason.find(words) != std::string::npos);
  };
  has(no_undo(std::nullopt, false, false), "nothing has been cut");
  has(no_undo(at(0), false, false), "nothing has been cut");
  has(no_undo(at(kFlagRedoable), false, false), "all strokes are undone; shift and z");
  has(no_undo(at(kFlagRedoable), kRemoved, false), "older strokes are not kept: 20 are");
  has(no_undo(at(0), kRemoved, false), "the last stroke is too long to be kept, above 12 MiB");
  has(no_undo(at(0), false, kCutBefore), "no stroke since this window joined");
  for (const std::uint32_t running : {kFlagReset, kFlagUndo, kFlagRedo}) {
    has(no_undo(at(running), kRemoved, false), "still being done; press z again");
  }
}

TEST_CASE("a tool that a scene lacks is told with the keys that it has") {
  CHECK(no_such_tool(6, 3) == "tool 7: the scene has 3; press 1 to 3");
  CHECK(no_such_tool(1, 1) == "tool 2: the scene has 1; press 1");
}

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

}  // namespace kerf::figures_test
