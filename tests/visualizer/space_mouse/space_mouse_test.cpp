// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <vector>

#include <doctest/doctest.h>

#include "visualizer/app/hand_control.hpp"

using namespace kerf;

namespace {

using Bytes = std::vector<std::uint8_t>;

// As the two layouts are described: x = 350, y = -350 (0xfea2), z = 35.
const Bytes kPush{1, 0x5e, 0x01, 0xa2, 0xfe, 0x23, 0x00};
const Bytes kTurn{2, 0x00, 0x00, 0x5e, 0x01, 0xdd, 0xff};
const Bytes kBoth{1, 0x5e, 0x01, 0xa2, 0xfe, 0x23, 0x00, 0x00, 0x00, 0x5e, 0x01, 0xdd, 0xff};

void check_axes(const SpaceMouseState& state) {
  CHECK(state.push == std::array{1.0, -1.0, 0.1});
  CHECK(state.turn == std::array{0.0, 1.0, -0.1});
}

/// A device that says these reports, one a call, and then nothing or that it is gone.
SpaceMouse mouse_of(std::vector<Bytes> reports, int then) {
  return SpaceMouse([reports, then, next = std::size_t{0}](std::span<std::uint8_t> out) mutable {
    if (next == reports.size()) return then;
    const Bytes& report = reports[next++];
    std::copy(report.begin(), report.end(), out.begin());
    return static_cast<int>(report.size());
  });
}

}  // namespace

TEST_CASE("axes come in two reports, or in one") {
  SpaceMouseState two, one;
  CHECK(take_report(kPush, two));
  CHECK(take_report(kTurn, two));
  CHECK(take_report(kBoth, one));
  check_axes(two);
  check_axes(one);
}

TEST_CASE(
    "the first button is a bit of its own report, and what lies beyond the cap's end its end") {
  SpaceMouseState state;
  CHECK(take_report(Bytes{3, 0x01, 0x00}, state));
  CHECK(state.button);
  CHECK(take_report(Bytes{3, 0x02}, state));
  CHECK_FALSE(state.button);
  CHECK(take_report(Bytes{1, 0xff, 0x7f, 0x00, 0x80, 0x00, 0x00}, state));
  CHECK(state.push == std::array{1.0, -1.0, 0.0});
}

TEST_CASE("what is no report changes nothing: empty, of every wrong length, foreign") {
  SpaceMouseState state;
  REQUIRE(take_report(kBoth, state));
  for (std::uint8_t id = 0; id < 30; ++id) {
    for (std::size_t size = 0; size <= 64; ++size) {
      Bytes report(size, 0x11);
      if (size > 0) report[0] = id;
      const bool known = (id == 1 && (size == 7 || size == 13)) || (id == 2 && size == 7) ||
                         (id == 3 && size >= 2 && size <= 8);
      SpaceMouseState after = state;
      CHECK(take_report(report, after) == known);
      if (!known) check_axes(after);
    }
  }
}

TEST_CASE("the cap moves the hand as it is pushed, and stays held until it says otherwise") {
  SpaceMouse mouse = mouse_of({kPush, kTurn, {3, 1}}, 0);
  for (int frame = 0; frame < 2; ++frame) {
    HeldControls held;
    CHECK_FALSE(mouse.step(held));
    CHECK(held.right == 1.0);
    CHECK(held.deeper == 1.0);  // pushed away from the user
    CHECK(held.up < 0.0);       // and a little down
    CHECK(held.tilt_right == -1.0);
    CHECK(held.tilt_up == 0.0);
    CHECK(held.press);
    CHECK(held.by_pad);
  }
}

TEST_CASE("a cap that is nearly at rest leads no hand") {
  SpaceMouse mouse = mouse_of({{1, 17, 0, 0xef, 0xff, 3, 0}}, 0);  // 17 of 350: 0.0486
  HeldControls held;
  CHECK_FALSE(mouse.step(held));
  CHECK(held.right == 0.0);
  CHECK_FALSE(held.by_pad);
}

TEST_CASE("one that is drawn out lets go of the hand, is told once, and the rest goes on") {
  SpaceMouse mouse = mouse_of({kPush, {3, 1}}, -1);
  HeldControls held;
  held.up = 1.0;  // by a key
  const auto told = mouse.step(held);
  REQUIRE(told);
  CHECK(told->find("SpaceMouse: it is gone; ") == 0);
  CHECK(held.right == 0.0);
  CHECK(held.up == 1.0);
  CHECK_FALSE(held.press);
  CHECK_FALSE(mouse.step(held));
}

TEST_CASE("a device that never stops talking holds up no frame") {
  SpaceMouse mouse([](std::span<std::uint8_t> out) {
    std::copy(kPush.begin(), kPush.end(), out.begin());
    return static_cast<int>(kPush.size());
  });
  HeldControls held;
  CHECK_FALSE(mouse.step(held));
  CHECK(held.right == 1.0);
}
