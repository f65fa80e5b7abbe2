// SPDX-License-Identifier: Apache-2.0
// The force of a program in place of contact: fading, holding, coupling, limits, log and replay.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <doctest/doctest.h>
#include <kerf/hand.hpp>
#include <kerf/log.hpp>
#include <kerf/scene.hpp>
#include <kerf/servo.hpp>
#include <kerf/tick.hpp>

#include "tests/support/temporary_folder.hpp"

namespace kerf::external_test {
namespace {

const std::string kScenes = KERF_SCENES;

kerf::Scene external(const kerf::Settings& settings = {}) {
  return kerf::Scene::load(kScenes + "/external.toml", settings);
}

/// A servo with its hand, picked up and beyond the fade after arming.
struct Loop {
  explicit Loop(const kerf::Scene& scene) : servo(scene), hand(scene) {
    while (servo.last().phase != static_cast<std::uint16_t>(kerf::Phase::active)) step();
  }
  const kerf::TickRecord& step() { return servo.step(hand.next(servo.last())); }
  const kerf::TickRecord& steps(int count) {
    for (int i = 1; i < count; ++i) step();
    return step();
  }
  /// `count` ticks with this force, given anew in each.
  const kerf::TickRecord& pushed(const kerf::ProgramForce& force, int count) {
    for (int i = 0; i < count; ++i) {
      REQUIRE(servo.give_force(force));
      step();
    }
    return servo.last();
  }

  kerf::Servo servo;
  kerf::Hand hand;
};

constexpr kerf::ProgramForce kUp{.force_n = {0, 0.5, 0}};

}  // namespace

TEST_CASE("a program's force fades in, holds, fades out without a new one and in again") {
  for (const char* numbers : {"fixed", "double"}) {
    CAPTURE(std::string(numbers));
    Loop loop(external({std::string("servo.numeric=\"") + numbers + "\""}));
    CHECK(loop.step().commanded_force_n[1] == 0);
    CHECK(loop.pushed(kUp, 1).contact_force_n[1] == doctest::Approx(0.005).epsilon(0.01));
    CHECK(loop.pushed(kUp, 98).contact_force_n[1] < 0.5F);
    CHECK(loop.pushed(kUp, 1).contact_force_n[1] == 0.5F);
    CHECK(loop.servo.last().commanded_force_n[1] == doctest::Approx(0.5).epsilon(1e-3));
    // Of 20 ms the last tick that gave it has one.
    CHECK(loop.steps(19).contact_force_n[1] == 0.5F);
    CHECK(loop.step().contact_force_n[1] < 0.5F);
    CHECK(loop.steps(13).contact_force_n[1] > 0);
    CHECK(loop.step().contact_force_n[1] == 0);
    CHECK(loop.pushed(kUp, 1).contact_force_n[1] == doctest::Approx(0.005).epsilon(0.01));
    CHECK(loop.servo.last().fault == 0);
  }
}

TEST_CASE("a program that is late by less than force.stale_ms has no effect") {
  Loop loop(external({"force.stale_ms=100"}));
  loop.pushed(kUp, 100);
  for (int i = 0; i < 20; ++i) {
    CHECK(loop.steps(99).contact_force_n[1] == 0.5F);
    CHECK(loop.pushed(kUp, 1).contact_force_n[1] == 0.5F);
  }
}

TEST_CASE("a program at 200 Hz is felt alike at every rate of the servo") {
  constexpr int kProgramHz = 200;
  constexpr double kStiffness = 0.4, kDamping = 0.001, kFadeMs = 100, kStaleMs = 20, kFallMs = 15;
  for (const int rate_hz : {250, 500, 1000, 2000, 4000, 8000}) {
    CAPTURE(rate_hz);
    const kerf::Scene scene = external({"servo.rate_hz=" + std::to_string(rate_hz)});
    REQUIRE(scene.rate_hz() == rate_hz);
    kerf::Servo servo(scene);
    kerf::Hand hand(scene);
    // A floor at y = 0, by its place: the servo renders the spring at its own rate. The tip begins
    // in its dock, below.
    bool was_above = false;
    const auto give = [&](std::uint64_t tick) {
      const std::uint64_t turn = tick * kProgramHz / static_cast<unsigned>(rate_hz);
      if (tick > 0 && turn == (tick - 1) * kProgramHz / static_cast<unsigned>(rate_hz)) return;
      const kerf::TickRecord& now = servo.last();
      kerf::ProgramForce force;
      was_above = was_above || now.position_mm[1] > 0;
      if (was_above && now.position_mm[1] < 0) {
        force.goal_mm = {now.position_mm[0], 0, now.position_mm[2]};
        force.stiffness_n_per_mm = kStiffness;
        force.damping_ns_per_mm = kDamping;
      }
      REQUIRE(servo.give_force(force));
    };
    // The scene's hand is 1 mm below the floor from 2.9 s on, for 0.6 s.
    const auto ticks_in = [&](double ms) { return static_cast<int>(ms * rate_hz / 1000); };
    const auto step = [&] { return servo.step(hand.next(servo.last())); };
    double pressed_n = 0;
    while (pressed_n < 0.2) {
      REQUIRE(servo.last().tick < 5 * static_cast<unsigned>(rate_hz));
      give(servo.last().tick);
      pressed_n = static_cast<double>(step().commanded_force_n[1]);
    }
    for (int i = 0; i < ticks_in(300); ++i) {  // beyond the moment at which it comes down
      give(servo.last().tick);
      step();
    }
    double worst_n = 0;
    for (int i = 0; i < ticks_in(100); ++i) {
      give(servo.last().tick);
      const kerf::TickRecord tick = step();
      const double want_n = kStiffness * -tick.position_mm[1] -
                            kDamping * static_cast<double>(tick.velocity_mm_per_s[1]);
      worst_n =
          std::max(worst_n, std::abs(static_cast<double>(tick.commanded_force_n[1]) - want_n));
    }
    CHECK(servo.last().position_mm[1] < -0.2);
    CHECK(worst_n < 0.01);  // a step of the motor's counts, and one of the encoders between reports
    // Its end: the force holds, falls, is gone, in the same time.
    int felt = 0;
    while (servo.last().contact_force_n[1] > 0) {
      step();
      ++felt;
    }
    const double tick_ms = 1000.0 / rate_hz, program_ms = 1000.0 / kProgramHz;
    CHECK(felt * tick_ms <= kStaleMs + kFallMs + 2 * tick_ms);
    CHECK(felt * tick_ms >= kStaleMs + kFallMs - program_ms - 2 * tick_ms);
    // And anew: it fades in.
    int fading = 0;
    float before_n = -1;
    while (servo.last().contact_force_n[1] > before_n) {
      before_n = servo.last().contact_force_n[1];
      REQUIRE(servo.give_force(kUp));
      step();
      ++fading;
    }
    CHECK((fading - 1) * tick_ms == doctest::Approx(kFadeMs).epsilon(0.05));
  }
}

TEST_CASE("a goal pulls as a spring with a damper at the rate of the servo") {
  const kerf::Scene scene = external();
  Loop loop(scene);
  for (int i = 0; i < 400; ++i) {
    const kerf::TickRecord before = loop.servo.last();
    const std::array goal_mm{before.position_mm[0], before.position_mm[1] + 2,
                             before.position_mm[2]};
    const kerf::TickRecord& tick =
        loop.pushed({.goal_mm = goal_mm, .stiffness_n_per_mm = 0.3, .damping_ns_per_mm = 0.001}, 1);
    if (i < 100) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double wanted = 0.3 * (goal_mm[axis] - tick.position_mm[axis]) -
                            0.001 * static_cast<double>(tick.velocity_mm_per_s[axis]);
      CHECK(static_cast<double>(tick.contact_force_n[axis]) ==
            doctest::Approx(wanted).epsilon(1e-3));
    }
  }
}

TEST_CASE("after a hold the force fades in") {
  Loop loop(external());
  loop.pushed(kUp, 100);
  REQUIRE(loop.servo.apply({kerf::ServoCommand::Kind::hold, 1}));
  CHECK(loop.pushed(kUp, 50).commanded_force_n[1] == 0);
  REQUIRE(loop.servo.apply({kerf::ServoCommand::Kind::hold, 0}));
  CHECK(loop.pushed(kUp, 1).contact_force_n[1] == doctest::Approx(0.005).epsilon(0.01));
  CHECK(loop.pushed(kUp, 99).contact_force_n[1] == 0.5F);
}

TEST_CASE("each of two arms has a force of its own, and one that gets none has none") {
  const kerf::Scene scene = kerf::Scene::parse(
      "[force]\nmodel = \"external\"\n[[device]]\n[[device]]\npersonality = \"omega\"\n", ".");
  REQUIRE(scene.arms() == 2);
  kerf::Servo servo(scene);
  kerf::Hand first(scene, kScenes + "/hands/touch.toml", {}, 0);
  kerf::Hand second(scene, kScenes + "/hands/touch.toml", {}, 1);
  const auto run = [&](int ticks, std::optional<float> first_n, std::optional<float> second_n) {
    for (int i = 0; i < ticks; ++i) {
      if (first_n) REQUIRE(servo.give_force({.force_n = {0, double{*first_n}, 0}}, 0));
      if (second_n) REQUIRE(servo.give_force({.force_n = {0, double{*second_n}, 0}}, 1));
      servo.step(std::array{first.next(servo.last(0)), second.next(servo.last(1))});
    }
  };
  run(1000, 0.25F, std::nullopt);
  CHECK(servo.last(0).contact_force_n[1] == 0.25F);
  CHECK(servo.last(1).contact_force_n[1] == 0);
  run(200, 0.25F, 0.5F);
  CHECK(servo.last(0).contact_force_n[1] == 0.25F);
  CHECK(servo.last(1).contact_force_n[1] == 0.5F);
  run(200, std::nullopt, 0.5F);
  CHECK(servo.last(0).contact_force_n[1] == 0);
  CHECK(servo.last(1).contact_force_n[1] == 0.5F);
  CHECK_FALSE(servo.give_force({}, 2));
}

TEST_CASE("a scene for a program needs nothing else, and refuses what contact alone has") {
  const auto problem = [](const std::string& text) {
    try {
      static_cast<void>(kerf::Scene::parse("[force]\nmodel = \"external\"\n" + text, "."));
    } catch (const kerf::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(problem("") == "");
  CHECK(problem("[cut]\nmodel = \"none\"\n") == "");
  CHECK(problem("friction = 0.1\n").find("force.friction") != std::string::npos);
  CHECK(problem("[cut]\nmodel = \"preston\"\n").find("leave it out") != std::string::npos);
  CHECK(problem("stale_ms = 0\n").find("force.stale_ms") != std::string::npos);
  CHECK(problem("[device]\nfit = true\n").find("there is none") != std::string::npos);
  CHECK(problem("[[volume]]\nfile = \"phantom\"\n") == "");
  CHECK(problem("[[tool]]\nshape = \"ball\"\nradius_mm = 3\n") == "");
}

TEST_CASE("a state that was kept has the force of the program") {
  Loop loop(external());
  loop.pushed(kUp, 50);
  const kerf::Servo::State kept = loop.servo.keep();
  const kerf::DeviceReport report{.fresh = false};
  const kerf::TickRecord next = loop.servo.step(report);
  loop.pushed({.force_n = {0.1, 0, 0}}, 3);
  loop.servo.restore(kept);
  CHECK(loop.servo.step(report).output_hash == next.output_hash);
}

TEST_CASE("the limits of the scene hold for a program too") {
  Loop loop(external());
  float last_n = 0, most_n = 0;
  for (int i = 0; i < 2000; ++i) {
    const double sign = i / 100 % 2 == 0 ? 1 : -1;
    const auto& tick = loop.pushed({.force_n = {0, sign * 255, 0}}, 1);
    const float now_n = tick.commanded_force_n[1];
    CHECK(std::abs(tick.contact_force_n[1]) <= 255);
    CHECK(std::abs(now_n) <= 2.0F);
    // A force that would push the hand away faster may end at once (docs/forces.md 5.4).
    CHECK(std::abs(now_n - last_n) <= std::max(0.51F, std::abs(last_n)));
    most_n = std::max(most_n, std::abs(now_n));
    last_n = now_n;
  }
  CHECK(most_n > 1.9F);
  CHECK(loop.servo.last().fault == 0);
}

TEST_CASE("what is no force is refused, and the last one holds") {
  Loop loop(external());
  loop.pushed(kUp, 100);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  CHECK_FALSE(loop.servo.give_force({.force_n = {0, kNan, 0}}));
  CHECK_FALSE(loop.servo.give_force({.goal_mm = {kInfinite, 0, 0}, .stiffness_n_per_mm = 0.1}));
  CHECK_FALSE(loop.servo.give_force({.goal_mm = {0, 1e307, 0}, .stiffness_n_per_mm = 0.1}));
  CHECK_FALSE(loop.servo.give_force({.force_n = {0, 256, 0}}));
  CHECK_FALSE(loop.servo.give_force({.stiffness_n_per_mm = 0.41}));
  CHECK_FALSE(loop.servo.give_force({.stiffness_n_per_mm = -0.1}));
  CHECK_FALSE(loop.servo.give_force({.stiffness_n_per_mm = kNan}));
  CHECK_FALSE(loop.servo.give_force({.damping_ns_per_mm = 0.0021}));
  CHECK_FALSE(loop.servo.give_force(kUp, 1));  // of one arm
  CHECK(loop.step().contact_force_n[1] == 0.5F);
  kerf::Servo other(kerf::Scene::load(kScenes + "/touch.toml"));
  CHECK_FALSE(other.give_force(kUp));
}

TEST_CASE("without a stiffness a goal is not looked at, whatever it is and whatever the scale") {
  for (const char* numbers : {"fixed", "double"}) {
    CAPTURE(std::string(numbers));
    Loop loop(
        external({std::string("servo.numeric=\"") + numbers + "\"", "device.workspace_scale=0.1"}));
    kerf::ProgramForce force = kUp;
    force.goal_mm = {1e307, -std::numeric_limits<double>::infinity(), 0};
    CHECK(loop.pushed(force, 100).contact_force_n[1] == 0.5F);
    CHECK(loop.servo.last().fault == 0);
  }
}

TEST_CASE("a run with a program's force is replayed from its log alone") {
  for (const char* numbers : {"fixed", "double"}) {
    CAPTURE(std::string(numbers));
    const kerf::test::TemporaryFolder folder;
    const kerf::Scene scene = external({std::string("servo.numeric=\"") + numbers + "\""});
    kerf::Servo servo(scene);
    kerf::Hand hand(scene);
    kerf::LogWriter log(folder.path() / "run", scene);
    float most_n = 0;
    for (int i = 0; i < 3000; ++i) {
      // At a fifth of the rate, with a gap, odd numbers and a goal that jumps.
      const bool silent = i > 1500 && i < 1600;
      if (i % 5 == 0 && !silent) {
        const double x = std::sin(0.013 * i);
        REQUIRE(servo.give_force({.force_n = {0.3 * x, -1.7 * x * x, 0.1},
                                  .goal_mm = {3 * x, 1, 20},
                                  .stiffness_n_per_mm = 0.123,
                                  .damping_ns_per_mm = 0.0017}));
      }
      log.add(servo.step(hand.next(servo.last())));
      most_n = std::max(most_n, std::abs(servo.last().commanded_force_n[1]));
    }
    log.close();
    CHECK(most_n > 0.5F);
    const auto read = kerf::Log::open(folder.path() / "run");
    CHECK(read.check().empty());
    const kerf::ReplayOutcome outcome = read.replay();
    CHECK(outcome.ticks == 3000);
    CHECK_FALSE(outcome.difference.has_value());
    // Other limits act on the same force.
    CHECK(read.replay({"limits.force_n=1"}).difference.has_value());
  }
}

}  // namespace kerf::external_test
