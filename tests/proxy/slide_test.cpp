// SPDX-License-Identifier: Apache-2.0
// F8, F9: what a hand feels that slides a ball over faces, through grooves and round in creases.
#include <cmath>
#include <numbers>
#include <string>

#include <doctest/doctest.h>

#include "tests/rig/contact_motions.hpp"
#include "tests/rig/contact_rig.hpp"

namespace kerf::slide_test {

using namespace kerf::extremes;

namespace {

constexpr double kRadius = 8;
const SceneTool kBall = tool_of_units("ball", kRadius, 2 * kRadius);

/// A slot along the frame's x with a half-round bottom, in a block whose top is at the frame's
/// y = radius.
Body slot(const Frame& frame, double radius) {
  return blurred({82, 82, 82}, [&](Point p) {
    const Point at = frame.of(p);
    const double wall = radius - (at[1] < 0 ? std::hypot(at[1], at[2]) : std::abs(at[2]));
    return std::max(wall, at[1] - radius);
  });
}

/// Work that one loop of the hand gives back, over all the work done there and back; mean over
/// loops, and the largest of one.
struct LoopGain {
  double mean = 0, largest = -1;
};

LoopGain gain_in_a_crease(double friction, int loops) {
  using N = DoubleNumbers;
  RandomNumbers random(21);
  LoopGain gain;
  for (int k = 0; k < loops; ++k) {
    Frame frame(random, {30, 30, 30});
    frame.place = frame.at(0, -8, 0);
    const Body volume = blurred({62, 62, 62}, [&](Point p) {
      const Point at = frame.of(p);
      return (at[1] - std::abs(at[2])) * std::sqrt(0.5);
    });
    const double rest = kRadius * std::sqrt(2.0);
    const Point middle = frame.at(0, rest - 3, 0), one = random.direction(),
                other = unit(cross(one, random.direction()));
    GuidedTool<N> guided(kBall, volume, frame.at(0, rest + 3, 0), friction);
    for (int i = 0; i < 60; ++i) guided.tick(middle + (6 - 0.1 * i) * frame.up);
    constexpr int kTicks = 250;
    double work = 0, moved = 0;
    Point last_hand = middle + 2 * one, last_force = guided.tick(last_hand);
    for (int i = 1; i <= 2 * kTicks; ++i) {
      const double phase = 2 * std::numbers::pi * i / kTicks;
      const Point hand = middle + 2 * std::cos(phase) * one + 2 * std::sin(phase) * other;
      const Point force = guided.tick(hand);
      const double part = dot(force + last_force, hand - last_hand) / 2;
      if (i > kTicks) {
        work += part;
        moved += std::abs(part);
      }
      last_hand = hand;
      last_force = force;
    }
    gain.mean += work / moved / loops;
    gain.largest = std::max(gain.largest, work / moved);
  }
  return gain;
}

}  // namespace

TEST_CASE("on one motion fixed point feels what double feels") {
  RandomNumbers random(5);
  const BumpSlide slide;
  const Bump bump(slide, random);
  const Body body = bump.body();
  const Point above = bump.hand(-bump.end(), -2);
  GuidedTool<FixedNumbers> fixed(kBall, body, above);
  GuidedTool<DoubleNumbers> exact(kBall, body, above);
  double squares = 0, most = 0, mean = 0;
  int count = 0;
  const auto follow = [&](Point hand) {
    const Point force = exact.tick(hand);
    const double off = length(fixed.tick(hand) - force);
    squares += off * off;
    most = std::max(most, off);
    mean += length(force);
    ++count;
  };
  for (double depth = -2; depth < slide.depth; depth += 0.1) {
    follow(bump.hand(-bump.end(), depth));
  }
  for (double angle = -bump.end(); angle < bump.end(); angle += bump.angle_step()) {
    follow(bump.hand(angle, slide.depth));
  }
  mean /= count;
  const double rms = std::sqrt(squares / count);
  MESSAGE("fixed against double: ", 100 * rms / mean, " % of the mean force rms, ",
          100 * most / mean, " % at most");
  CHECK(most < 5e-4 * mean);
}

// Without play a ball does not find its way in, so it starts there.
TEST_CASE_TEMPLATE("a ball follows a slot with play, with hardly any and with none, and comes out",
                   N, FixedNumbers, DoubleNumbers) {
  for (const double radius : {8.5, 8.1, 8.0}) {
    for (const double aside : {0.0, 1.0}) {
      RandomNumbers random(7);
      const double start = radius > kRadius ? radius + 4 : 0.2;
      double force_step = 0, behind = 0, pulled = 0, held = 0;
      int queries = 0;
      for (int k = 0; k < 2; ++k) {
        const Frame frame(random, {40, 40, 40});
        const Body volume = slot(frame, radius);
        GuidedTool<N> guided(kBall, volume, frame.at(-12, start, 0));
        const auto tick = [&](Point hand) {
          const Point force = guided.tick(hand);
          queries = std::max(queries, guided.swept().queries);
          return force;
        };
        for (int i = 0; i <= 50; ++i) {
          const double in = i / 50.0;
          guided.tick(frame.at(-12, start * (1 - in) - 2 * in, aside * in));
        }
        for (double x = -12; x < -10; x += 0.2) tick(frame.at(x, -2, aside));
        Roughness roughness;
        for (double x = -10; x < 12; x += 0.2) {
          const Point force = tick(frame.at(x, -2, aside));
          roughness.add(force);
          behind = std::max(behind, std::abs(dot(force, frame.along)));
        }
        Point force{};
        for (double y = -2; y < radius + 4; y += 0.1) {
          force = tick(frame.at(12, y, aside * std::max(0.0, -y / 2)));
          if (y > 1) pulled = std::max(pulled, length(force));
        }
        held = std::max(held, length(force));
        force_step = std::max(force_step, roughness.ratio());
      }
      MESSAGE(std::string(N::kName)
              << ", slot of " << radius << ", pushed aside by " << aside << ": force steps by "
              << 100 * force_step << " %, " << behind << " units behind, " << queries
              << " queries at most; " << pulled << " units of force on the way out");
      if (radius > kRadius) CHECK(queries <= 12);
      CHECK(force_step < 0.02);
      CHECK(behind < 0.02);
      CHECK(pulled < 1);
      CHECK(held < 0.01);
    }
  }
}

// The estimate is no exact potential: without friction a crease can give energy back, a little.
TEST_CASE("a loop of the hand in a crease gives nothing back under a little friction") {
  const LoopGain smooth = gain_in_a_crease(0, 10), rough = gain_in_a_crease(0.02, 10);
  MESSAGE("gain of a loop: " << 100 * smooth.mean << " %, at most " << 100 * smooth.largest
                             << " %; with friction 0.02 " << 100 * rough.mean << " %, at most "
                             << 100 * rough.largest << " %");
  CHECK(smooth.largest < 0.01);
  CHECK(rough.largest < 0);
}

}  // namespace kerf::slide_test
