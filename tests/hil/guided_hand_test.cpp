// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <doctest/doctest.h>

#include "hil/device/emulator.hpp"
#include "hil/device/hand.hpp"
#include "hil/device/omni.hpp"

namespace {

using kerf::DeviceVec;
using kerf::GuidedHand;
using kerf::HandGoal;
using kerf::HandTarget;

constexpr double kStiffness = 0.5;  // N/mm

HandGoal start_at(DeviceVec<double> mm) {
  HandGoal goal;
  goal.in_inkwell = false;
  goal.target_mm = mm;
  return goal;
}

const HandGoal kStart = start_at({0, 5, 0});

GuidedHand hand_at_start() {
  return {kStiffness, kerf::OmniModel().route(), kStart.target_mm};
}

/// A tip that goes wherever the hand wants it, for so long; the fastest it moved in a cycle.
double follow(GuidedHand& hand, DeviceVec<double>& tip_mm, double seconds) {
  double fastest = 0;
  for (auto left = kerf::cycles_of(seconds); left > 0; --left) {
    const DeviceVec<double> goal = hand.next(kStart, tip_mm).target_mm;
    fastest = std::max(fastest, norm(goal - tip_mm) / kerf::kCycleS);
    tip_mm = goal;
  }
  return fastest;
}

/// The same of a user who goes on wishing.
void lead(GuidedHand& hand, DeviceVec<double>& tip_mm, const HandTarget& wish, double seconds) {
  for (int frames = static_cast<int>(seconds * 50); frames > 0; --frames) {
    hand.wish(wish);
    follow(hand, tip_mm, 0.02);
  }
}

}  // namespace

TEST_CASE("a hand that nobody leads stays at its start") {
  GuidedHand hand = hand_at_start();
  hand.forsake();
  DeviceVec<double> tip = kStart.target_mm;
  follow(hand, tip, 3);
  CHECK(tip == kStart.target_mm);
}

TEST_CASE("it follows a wish with its lag, and far ones no faster than a hand's stroke") {
  GuidedHand hand = hand_at_start();
  DeviceVec<double> tip = kStart.target_mm;
  hand.wish({.tip_mm = {1, 5, 0}});
  follow(hand, tip, GuidedHand::kLagS);
  CHECK(tip.x == doctest::Approx(1 - std::exp(-1.0)).epsilon(0.01));
  hand.wish({.tip_mm = {40, 5, 0}});
  CHECK(follow(hand, tip, 0.1) == doctest::Approx(GuidedHand::kMaxSpeedMmPerS));
}

TEST_CASE("it pulls at a tip that is held no harder than it may") {
  GuidedHand hand = hand_at_start();
  const DeviceVec<double> held = kStart.target_mm;
  HandGoal goal;
  for (int frame = 0; frame < 50; ++frame) {
    hand.wish({.tip_mm = {0, -100, 0}});
    for (int i = 0; i < 160; ++i) goal = hand.next(kStart, held);
  }
  CHECK(norm(goal.target_mm - held) * kStiffness == doctest::Approx(GuidedHand::kMaxPullN));
}

TEST_CASE("without wishes it presses no more, then withdraws to its start: straight up first") {
  for (const bool told : {false, true}) {
    CAPTURE(told);
    GuidedHand hand = hand_at_start();
    DeviceVec<double> tip = kStart.target_mm;
    lead(hand, tip, {.tip_mm = {6, -2, 0}, .button1 = true}, 1);
    CHECK(hand.next(kStart, tip).button1);
    // The tooth holds the tip 1 mm above the wish.
    DeviceVec<double> held{6, -1, 0};
    if (told) hand.forsake();
    HandGoal goal;
    const auto hold = [&](double seconds) {
      for (auto left = kerf::cycles_of(seconds); left > 0; --left) goal = hand.next(kStart, held);
    };
    hold((told ? 0 : GuidedHand::kStaleS) + 0.2);
    CHECK(norm(goal.target_mm - held) < 0.01);
    CHECK_FALSE(goal.button1);
    hold(GuidedHand::kPatienceS - 0.3);
    tip = held;
    follow(hand, tip, 0.2);
    CHECK(tip.x == doctest::Approx(6).epsilon(0.01));
    CHECK(tip.y > -1);
    follow(hand, tip, 2);
    CHECK(norm(tip - kStart.target_mm) < 0.1);
    // And a wish takes it from there.
    lead(hand, tip, {.tip_mm = {2, 3, 1}}, 1);
    CHECK(norm(tip - DeviceVec<double>{2, 3, 1}) < 0.01);
  }
}

TEST_CASE("a wish survives its packet, within its limits; whatever else comes is none") {
  const HandTarget wish{.tip_mm = {1.5, -2.25, 499},
                        .orientation_rad = {0.5, -0.25, 0},
                        .button2 = true,
                        .park = true};
  const auto bytes = encode(wish);
  CHECK(kerf::decode_hand_wish(bytes) == wish);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double huge = std::numeric_limits<double>::infinity();
  const auto odd = kerf::decode_hand_wish(
      encode(HandTarget{.tip_mm = {nan, huge, -huge}, .orientation_rad = {nan, 9, -9}}));
  REQUIRE(odd);
  CHECK(odd->tip_mm == DeviceVec<double>{0, kerf::kMaxWishMm, -kerf::kMaxWishMm});
  CHECK(odd->orientation_rad[1] == doctest::Approx(kerf::kMaxWishRad));
  auto far = bytes;
  far[11] = 0x80;  // -2147 m
  CHECK(kerf::decode_hand_wish(far)->tip_mm.x == -kerf::kMaxWishMm);
  CHECK_FALSE(kerf::decode_hand_wish(std::span(bytes).first(35)));
  CHECK_FALSE(kerf::decode_hand_wish({}));
  auto other = bytes;
  other[7] = 2;
  CHECK_FALSE(kerf::decode_hand_wish(other));
  other = bytes;
  other[32] = 8;
  CHECK_FALSE(kerf::decode_hand_wish(other));
}

TEST_CASE("an emulated hand goes its way to the start, and only then where it is led") {
  kerf::Emulator emulator(kerf::OmniParams{}, kerf::HandScript{});
  const kerf::OmniCommand on{.motors_on = true};
  const auto run = [&](double seconds) {
    for (int frames = static_cast<int>(seconds * 50); frames > 0; --frames) {
      emulator.wish({.tip_mm = {10, 8, -5}, .orientation_rad = {0, 0.3, 0}});
      emulator.receive(encode(on));
      emulator.advance(160);
    }
  };
  run(0.04);
  CHECK(emulator.model().docked());
  run(0.16);
  CHECK_FALSE(emulator.model().docked());
  CHECK(emulator.model().tip_mm().z < -20);
  run(1.7);
  CHECK(norm(emulator.model().tip_mm() - DeviceVec<double>{10, 8, -5}) < 0.5);
}

TEST_CASE("asked to park it rests in the inkwell, whatever is wished meanwhile, and comes back") {
  kerf::Emulator emulator(kerf::OmniParams{}, kerf::HandScript{});
  const DeviceVec<double> wished{4, -3, 2};
  int docked = 0;
  const auto run = [&](double seconds, bool park) {
    for (int frames = static_cast<int>(seconds * 50); frames > 0; --frames) {
      emulator.wish({.tip_mm = wished, .park = park});
      emulator.receive(encode(kerf::OmniCommand{.motors_on = true}));
      emulator.advance(160);
      docked += emulator.model().docked() ? 1 : 0;
    }
  };
  run(2.5, false);
  CHECK(norm(emulator.model().tip_mm() - wished) < 0.5);
  docked = 0;
  run(0.1, true);
  run(4, false);
  CHECK(docked * 0.02 >= GuidedHand::kParkedS - 0.05);
  run(2, false);
  CHECK_FALSE(emulator.model().docked());
  CHECK(norm(emulator.model().tip_mm() - wished) < 0.5);
}
