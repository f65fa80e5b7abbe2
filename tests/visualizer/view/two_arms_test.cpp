// SPDX-License-Identifier: Apache-2.0
// What a session and the panels know of a second arm.
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <doctest/doctest.h>

#include "shared/segment/server.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"
#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/picture/picture.hpp"

namespace kerf::two_arms_test {

using namespace kerf::test;

namespace {

constexpr std::uint16_t kArmed = 2, kFault = 5;
constexpr std::uint32_t kOverspeed = 3;

const std::string kScene = R"({
  "volumes": [{"name": "block", "solid": true}],
  "tools": [{"name": "ball", "profile": [[-2, 0], [0, 2], [2, 0]]},
            {"name": "pin", "profile": [[0, 0], [6, 0.8]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]}]})";
/// The same with the temperature of the pulp as a mark.
const std::string kWarmScene =
    R"({"cut": {"pulp": "dry"}, "spindle": {"stall_torque_n_mm": 3},)" + kScene.substr(1);

TickRecord at(double x_mm, std::uint32_t tool) {
  TickRecord record{};
  record.position_mm[0] = x_mm;
  record.orientation[3] = 1;
  record.active_tool = tool;
  record.flags = kFlagStarted;
  return record;
}

struct Run {
  explicit Run(std::size_t arms = 2, const std::string& scene = kScene)
      : writer(SegmentWriter::create(spec(arms, scene))), server("two", writer) {
    writer.set_lifecycle(Lifecycle::run);
  }
  [[nodiscard]] SegmentSpec spec(std::size_t arms, const std::string& scene) const {
    SegmentSpec out = spec_of(volume);
    out.scene_json = scene;
    out.arms = arms;
    return out;
  }
  void publish(TickRecord first, std::optional<TickRecord> second = {}) {
    writer.begin_tick(++tick);
    first.tick = tick;
    if (second) {
      second->tick = tick;
      writer.publish_state(*second, 1);
    }
    writer.publish_state(first);
    writer.end_tick(0);
  }
  RuntimeFolder folder;
  NoiseVolume volume{{8, 8, 8}};
  SegmentWriter writer;
  SegmentServer server;
  Tick tick = 0;
};

/// The banner of a run that publishes these; without a heartbeat, whose age would take it.
std::string banner_of(const TickRecord& first, const TickRecord& second, bool* alarm = nullptr) {
  Run run;
  run.publish(first, second);
  const Session session("two");
  const OverlayFigures figures = overlay_figures(session);
  if (alarm != nullptr) *alarm = figures.alarm;
  return figures.banner;
}

}  // namespace

TEST_CASE("a session has both arms' records of one tick, and both hands") {
  Run run;
  Session session("two");
  CHECK(session.scene().arms == 2);
  CHECK(!session.second());
  for (int i = 1; i <= 3; ++i) {
    run.publish(at(i, 0), at(-i, 1));
    session.poll();
    REQUIRE(session.second());
    CHECK(session.second()->tick == session.latest()->tick);
    const Hands hands = hands_of(session);
    REQUIRE(hands[0]);
    REQUIRE(hands[1]);
    CHECK(hands[0]->tip_mm.x == i);
    CHECK(hands[1]->tip_mm.x == -i);
    CHECK(hands[1]->tool == 1);
  }
  TickRecord lost = at(std::numeric_limits<double>::quiet_NaN(), 0);
  run.publish(lost, at(7, 1));
  session.poll();
  CHECK(!hands_of(session)[0]);  // not docked yet: the other one is drawn all the same
  CHECK(hands_of(session)[1]);
}

TEST_CASE("a tick of which one record is missing is not shown: both arms stay at the one before") {
  Run run;
  Session session("two");
  run.publish(at(1, 0), at(-1, 1));
  session.poll();
  run.publish(at(2, 0));  // the second one's has been overwritten meanwhile
  session.poll();
  REQUIRE(session.latest());
  REQUIRE(session.second());
  CHECK(session.latest()->tick == 1);
  CHECK(session.second()->tick == 1);
}

TEST_CASE("the force of each arm is rounded to what its line shows") {
  OverlayFigures figures;
  figures.force_n = 1.236;
  CHECK(!figures.rounded().second);
  figures.second = {.force_n = 2.344, .tool = "pin", .state = "in_hand", .alarm = false};
  CHECK(figures.rounded().force_n == doctest::Approx(1.24));
  CHECK(figures.rounded().second->force_n == doctest::Approx(2.34));
  CHECK(figures.rounded().second->tool == "pin");
}

TEST_CASE("with one arm there is no second record, hand or line") {
  Run run(1);
  run.publish(at(1, 0));
  const Session session("two");
  CHECK(session.scene().arms == 1);
  CHECK(!session.second());
  CHECK(!hands_of(session)[1]);
  CHECK(!overlay_figures(session).second);
}

TEST_CASE("the panel has force, tool and phase of the second arm, or its fault") {
  Run run;
  TickRecord second = at(1, 1);
  second.commanded_force_n[0] = 3;
  second.commanded_force_n[2] = 4;
  second.phase = kArmed;
  run.publish(at(1, 0), second);
  Session session("two");
  OverlayFigures figures = overlay_figures(session);
  REQUIRE(figures.second);
  CHECK(figures.force_n == 0);
  CHECK(figures.tool == "ball");
  CHECK(figures.second->force_n == doctest::Approx(5));
  CHECK(figures.second->tool == "pin");
  CHECK(figures.second->state == "armed");
  CHECK(!figures.second->alarm);
  second.phase = kFault;
  second.fault = kOverspeed;
  run.publish(at(1, 0), second);
  session.poll();
  figures = overlay_figures(session);
  CHECK(figures.second->state == "overspeed");
  CHECK(figures.second->alarm);
}

TEST_CASE("the banner is the first arm's, unless only the second has something urgent to say") {
  const TickRecord calm = at(1, 0);
  TickRecord shaft = calm, forbidden = calm, fault = calm, armed = calm;
  shaft.flags |= kFlagShaft;
  forbidden.flags |= kFlagForbidden;
  fault.phase = kFault;
  fault.fault = kOverspeed;
  armed.phase = kArmed;
  bool alarm = false;
  CHECK(banner_of(calm, calm).empty());
  CHECK(banner_of(shaft, calm) == "the shaft touches: it cuts nothing");
  CHECK(banner_of(calm, shaft, &alarm) == "second arm: the shaft touches: it cuts nothing");
  CHECK(!alarm);
  CHECK(banner_of(shaft, forbidden, &alarm) == "second arm: pressed on what may not be cut");
  CHECK(alarm);
  CHECK(banner_of(forbidden, fault).starts_with("pressed"));
  CHECK(banner_of(armed, fault).starts_with("second arm: fault overspeed"));
  CHECK(banner_of(fault, armed).starts_with("fault overspeed"));
}

TEST_CASE("what may not be cut counts once a tick, whichever arm presses on it") {
  Run run;
  Session session("two");
  TickRecord presses = at(1, 0);
  presses.flags |= kFlagForbidden;
  run.publish(at(1, 0), presses);
  run.publish(presses, at(1, 0));
  run.publish(presses, presses);
  run.publish(at(1, 0), at(1, 0));
  session.poll();
  CHECK(session.forbidden_ms() == doctest::Approx(3));
  presses.flags |= kFlagReset;  // of the volumes, in the tick of a press: that one counts already
  run.publish(at(1, 0), presses);
  session.poll();
  CHECK(session.forbidden_ms() == doctest::Approx(1));
}

TEST_CASE("both arms' spindles warm the pulp, tick by tick, until the volumes are reset") {
  Run run(2, kWarmScene);
  Session session("two");
  TickRecord cuts = at(1, 0);
  cuts.spindle_load = 0.5F;
  cuts.spindle_ratio = 1;
  for (int i = 0; i < 10; ++i) run.publish(cuts, cuts);
  session.poll();
  REQUIRE(session.pulp());
  // 2 x 0.5 x 3 N mm x 31416 / s = 94.2 W for 10 ms.
  CHECK(session.pulp()->rise_c() == doctest::Approx(PulpHeat::kPerJ * 94.25 * 0.01).epsilon(1e-3));
  CHECK(overlay_figures(session).pulp_rise_c == session.pulp()->rise_c());
  TickRecord reset = at(1, 0);
  reset.flags |= kFlagReset;
  run.publish(reset, reset);
  session.poll();
  CHECK(session.pulp()->rise_c() == 0);
}

TEST_CASE("a scene without the mark of the pulp has none in the window") {
  Run run;
  CHECK(!Session("two").pulp());
}

TEST_CASE("a run counts as armed from the first arm that is picked up") {
  Run run;
  Session session("two");
  TickRecord parked = at(1, 0);
  parked.flags = 0;
  run.publish(parked, parked);
  session.poll();
  CHECK(!session.ticks_since_armed());
  run.publish(parked, at(1, 1));
  run.publish(at(1, 0), at(1, 1));
  session.poll();
  CHECK(session.ticks_since_armed() == 1);
}

}  // namespace kerf::two_arms_test
