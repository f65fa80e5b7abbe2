// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/supervisor.hpp"

#include <array>
#include <vector>

#include <doctest/doctest.h>

using kerf::Fault;
using kerf::Phase;
using kerf::SafetyInputs;
using kerf::SafetyTiming;
using kerf::Supervisor;

namespace {

constexpr SafetyTiming kTiming;
constexpr SafetyInputs kDocked{.fresh = true, .docked = true, .calibrated = true};
constexpr SafetyInputs kDockBit{.fresh = true, .docked = true};  // not yet at rest
constexpr SafetyInputs kFree{.fresh = true};
constexpr SafetyInputs kSilent{};

Supervisor after(std::initializer_list<std::pair<SafetyInputs, int>> script) {
  Supervisor s;
  for (const auto& [input, ticks] : script) {
    for (int i = 0; i < ticks; ++i) kerf::supervise(kTiming, input, s);
  }
  return s;
}

std::vector<SafetyInputs> all_inputs() {
  std::vector<SafetyInputs> inputs;
  for (unsigned bits = 0; bits < 32; ++bits) {
    inputs.push_back({.fresh = (bits & 1) != 0,
                      .docked = (bits & 2) != 0,
                      .calibrated = (bits & 18) == 18,
                      .finite = (bits & 4) != 0,
                      .overspeed = (bits & 8) != 0});
  }
  return inputs;
}

}  // namespace

TEST_CASE("motors stay off until the stylus was docked and taken out again") {
  CHECK_FALSE(after({{kFree, 1000}}).motors_on());
  CHECK_FALSE(after({{kDocked, 1000}}).motors_on());
  CHECK(after({{kDocked, 1}, {kFree, 1}}).phase == Phase::ramping);
  CHECK(after({{kDocked, 1}, {kFree, 150}}).phase == Phase::active);
}

TEST_CASE("docking switches the motors off and clears a fault") {
  CHECK_FALSE(after({{kDocked, 1}, {kFree, 150}, {kDocked, 1}}).motors_on());
  const Supervisor again =
      after({{kDocked, 1}, {kFree, 150}, {kSilent, 30}, {kDocked, 1}, {kFree, 1}});
  CHECK(again.fault == Fault::none);
  CHECK(again.phase == Phase::ramping);
}

TEST_CASE("the docked bit alone switches off, but neither calibrates nor forgives") {
  CHECK(after({{kDockBit, 1000}}).phase == Phase::calibrating);
  CHECK(after({{kDockBit, 1}, {kFree, 10}}).phase == Phase::calibrating);
  CHECK_FALSE(after({{kDocked, 1}, {kFree, 150}, {kDockBit, 1}}).motors_on());
  CHECK(after({{kDocked, 1}, {kFree, 150}, {kDockBit, 1}, {kFree, 1}}).phase == Phase::ramping);
  const Supervisor faulty = after({{kDocked, 1}, {kFree, 150}, {kSilent, 30}, {kDockBit, 5}});
  CHECK(faulty.fault == Fault::stale_input);
  CHECK(faulty.phase == Phase::fault);
}

TEST_CASE("missing reports: tolerated for less than 20 ms, then a latched fault") {
  CHECK(after({{kDocked, 1}, {kFree, 150}, {kSilent, 19}}).motors_on());
  const Supervisor gone = after({{kDocked, 1}, {kFree, 150}, {kSilent, 20}});
  CHECK(gone.fault == Fault::stale_input);
  CHECK(after({{kDocked, 1}, {kFree, 150}, {kSilent, 20}, {kFree, 500}}).phase == Phase::fault);
}

TEST_CASE("the held force is whole up to 5 ms and gone at 20 ms, falling in between") {
  CHECK(kerf::stale_share(kTiming, 5) == kTiming.zero_ticks - kTiming.hold_ticks);
  CHECK(kerf::stale_share(kTiming, 20) == 0);
  for (std::uint32_t t = 5; t < 20; ++t) {
    CHECK(kerf::stale_share(kTiming, t + 1) < kerf::stale_share(kTiming, t));
  }
}

TEST_CASE("too fast, or not finite for more than 2 ms, ends the motors at once") {
  const SafetyInputs fast{.fresh = true, .overspeed = true};
  CHECK(after({{kDocked, 1}, {kFree, 150}, {fast, 1}}).fault == Fault::overspeed);
  const SafetyInputs nan{.fresh = true, .finite = false};
  CHECK(after({{kDocked, 1}, {kFree, 150}, {nan, 2}}).motors_on());
  CHECK(after({{kDocked, 1}, {kFree, 150}, {nan, 3}}).fault == Fault::not_finite);
}

TEST_CASE("every reachable state and input: only legal transitions, no motors with a fault") {
  // Breadth first over all inputs, with short timings so that the whole state space is visited.
  constexpr SafetyTiming kShort{
      .hold_ticks = 1, .zero_ticks = 3, .not_finite_ticks = 1, .fade_in_ticks = 2};
  const auto key = [](const Supervisor& s) {
    return std::array<std::uint32_t, 6>{
        static_cast<std::uint32_t>(s.phase), static_cast<std::uint32_t>(s.fault), s.armed ? 1U : 0U,
        std::min(s.stale_ticks, 5U),         std::min(s.not_finite_ticks, 4U),    s.fade_ticks};
  };
  std::vector<Supervisor> states{Supervisor{}};
  std::vector<std::array<std::uint32_t, 6>> seen{key(states[0])};
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (const SafetyInputs& input : all_inputs()) {
      const Supervisor before = states[i];
      Supervisor s = before;
      kerf::supervise(kShort, input, s);
      REQUIRE((s.phase == Phase::fault) == (s.fault != Fault::none));
      REQUIRE_FALSE((s.motors_on() && s.fault != Fault::none));
      REQUIRE((!s.motors_on() || s.armed));
      if (before.phase != s.phase) {
        const bool legal =
            s.phase == Phase::docked
                ? input.fresh && input.docked && (input.calibrated || before.motors_on())
            : s.phase == Phase::ramping ? before.phase == Phase::docked
            : s.phase == Phase::active
                ? before.phase == Phase::ramping || before.phase == Phase::docked
                : s.phase == Phase::fault && (before.motors_on() || before.phase == Phase::docked);
        REQUIRE(legal);
      }
      if (input.fresh && input.docked) REQUIRE_FALSE(s.motors_on());
      if (std::find(seen.begin(), seen.end(), key(s)) == seen.end()) {
        seen.push_back(key(s));
        s.stale_ticks = std::min(s.stale_ticks, 5U);
        s.not_finite_ticks = std::min(s.not_finite_ticks, 4U);
        states.push_back(s);
      }
    }
  }
  CHECK(states.size() >= 30);
}
