// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/supervisor.hpp"

#include <array>
#include <vector>

#include <doctest/doctest.h>

namespace kerf::supervisor_test {
namespace {

constexpr SafetyTiming kTiming;
constexpr SafetyInputs kRested{.fresh = true, .parked = true, .calibrated = true};
constexpr SafetyInputs kParkBit{.fresh = true, .parked = true};  // not yet at rest
constexpr SafetyInputs kUnhomed{.fresh = true, .homed = false};
constexpr SafetyInputs kFree{.fresh = true};
constexpr SafetyInputs kSilent{};

Supervisor after(std::initializer_list<std::pair<SafetyInputs, int>> script) {
  Supervisor s;
  for (const auto& [input, ticks] : script) {
    for (int i = 0; i < ticks; ++i) supervise(kTiming, input, s);
  }
  return s;
}

std::vector<SafetyInputs> all_inputs() {
  std::vector<SafetyInputs> inputs;
  for (unsigned bits = 0; bits < 128; ++bits) {
    const bool homed = (bits & 32) == 0;
    inputs.push_back({.fresh = (bits & 1) != 0,
                      .parked = (bits & 2) != 0,
                      .calibrated = (bits & 82) == 18 && homed,
                      .misplaced = (bits & 83) == 83 && homed,
                      .homed = homed,
                      .finite = (bits & 4) != 0,
                      .overspeed = (bits & 8) != 0});
  }
  return inputs;
}

/// The arrows of the diagram in supervisor.hpp, each with what it needs.
bool is_legal(const Supervisor& before, Phase after, const SafetyInputs& in) {
  const bool parked = in.fresh && in.homed && in.parked;
  const bool rested = parked && in.calibrated;
  switch (after) {
    case Phase::off:
      return false;
    case Phase::calibrating:
      return in.fresh &&
             (before.phase == Phase::off || (!in.homed && before.phase != Phase::fault));
    case Phase::armed:
      return rested || (parked && before.motors_on());
    case Phase::ramping:
      return before.phase == Phase::armed && in.fresh && in.homed && !in.parked;
    case Phase::active:
      return before.phase == Phase::ramping;
    case Phase::fault:
      return before.motors_on() ||
             before.phase == Phase::armed ||  // taken and found bad in one tick
             (parked && in.misplaced);
  }
  return false;
}

}  // namespace

TEST_CASE("motors stay off until the device was parked and picked up") {
  CHECK_FALSE(after({{kFree, 1000}}).motors_on());
  CHECK_FALSE(after({{kRested, 1000}}).motors_on());
  CHECK(after({{kSilent, 1000}}).phase == Phase::off);
  CHECK(after({{kSilent, 10}, {kFree, 1}}).phase == Phase::calibrating);
  CHECK_FALSE(after({{kFree, 1000}, {kRested, 1000}}).started);
  CHECK(after({{kRested, 1}, {kFree, 1}}).started);
  CHECK(after({{kRested, 1}, {kFree, 1}, {kSilent, 1000}}).started);  // for good
  CHECK(after({{kRested, 1}, {kFree, 1}}).phase == Phase::ramping);
  CHECK(after({{kRested, 1}, {kFree, 150}}).phase == Phase::active);
}

TEST_CASE("parking switches the motors off and clears a fault") {
  CHECK_FALSE(after({{kRested, 1}, {kFree, 150}, {kRested, 1}}).motors_on());
  const Supervisor again =
      after({{kRested, 1}, {kFree, 150}, {kSilent, 30}, {kRested, 1}, {kFree, 1}});
  CHECK(again.fault == Fault::none);
  CHECK(again.phase == Phase::ramping);
}

TEST_CASE("the parked bit alone switches off, but neither calibrates nor forgives") {
  CHECK(after({{kParkBit, 1000}}).phase == Phase::calibrating);
  CHECK(after({{kParkBit, 1}, {kFree, 10}}).phase == Phase::calibrating);
  CHECK_FALSE(after({{kRested, 1}, {kFree, 150}, {kParkBit, 1}}).motors_on());
  CHECK(after({{kRested, 1}, {kFree, 150}, {kParkBit, 1}, {kFree, 1}}).phase == Phase::ramping);
  const Supervisor faulty = after({{kRested, 1}, {kFree, 150}, {kSilent, 30}, {kParkBit, 5}});
  CHECK(faulty.fault == Fault::stale_input);
  CHECK(faulty.phase == Phase::fault);
}

TEST_CASE("a device that loses its homing must be homed and parked again") {
  CHECK(after({{kUnhomed, 100}}).phase == Phase::calibrating);
  const Supervisor lost = after({{kRested, 1}, {kFree, 150}, {kUnhomed, 1}});
  CHECK(lost.phase == Phase::calibrating);
  CHECK_FALSE(lost.motors_on());
  CHECK(after({{kRested, 1}, {kFree, 150}, {kUnhomed, 1}, {kFree, 500}}).phase ==
        Phase::calibrating);
  CHECK(after({{kRested, 1}, {kFree, 150}, {kUnhomed, 1}, {kRested, 1}, {kFree, 1}}).phase ==
        Phase::ramping);
  CHECK(after({{kRested, 1}, {kFree, 150}, {kSilent, 20}, {kUnhomed, 9}}).phase == Phase::fault);
}

TEST_CASE("missing reports: tolerated for less than 20 ms, then a latched fault") {
  CHECK(after({{kRested, 1}, {kFree, 150}, {kSilent, 19}}).motors_on());
  const Supervisor gone = after({{kRested, 1}, {kFree, 150}, {kSilent, 20}});
  CHECK(gone.fault == Fault::stale_input);
  CHECK(after({{kRested, 1}, {kFree, 150}, {kSilent, 20}, {kFree, 500}}).phase == Phase::fault);
}

TEST_CASE("ticks that the host missed in a silence are silent ones") {
  for (int before = 0; before <= 20; ++before) {
    for (std::uint32_t missed = 1; missed <= 25; ++missed) {
      CAPTURE(before);
      CAPTURE(missed);
      Supervisor late = after({{kRested, 1}, {kFree, 150}, {kSilent, before}});
      miss_ticks(missed, late);
      supervise(kTiming, kSilent, late);
      const int ticks = before + static_cast<int>(missed) + 1;
      const Supervisor looked = after({{kRested, 1}, {kFree, 150}, {kSilent, ticks}});
      CHECK(late.stale_ticks == looked.stale_ticks);
      CHECK(late.fault == looked.fault);
      supervise(kTiming, kFree, late);
      CHECK(late.stale_ticks == 0);
    }
  }
  Supervisor none = after({{kRested, 1}, {kFree, 150}, {{.fresh = true, .finite = false}, 1}});
  miss_ticks(1, none);
  supervise(kTiming, {.fresh = true, .finite = false}, none);
  CHECK(none.fault == Fault::not_finite);
  // Ticks before the first such pose are none of it, and no count wraps.
  Supervisor well = after({{kRested, 1}, {kFree, 150}});
  miss_ticks(UINT32_MAX, well);
  miss_ticks(UINT32_MAX, well);
  CHECK(well.stale_ticks == UINT32_MAX);
  supervise(kTiming, {.fresh = true, .finite = false}, well);
  CHECK(well.motors_on());
}

TEST_CASE("reports that come too seldom for too long are a fault; a single gap is forgiven") {
  const auto fault_after = [](int period, int pause, int periods) {
    Supervisor s = after({{kRested, 1}, {kFree, 150}});
    for (int i = 0; i < periods && s.fault == Fault::none; ++i) {
      for (int tick = 1; tick < period; ++tick) supervise(kTiming, kSilent, s);
      for (int tick = 0; tick <= pause; ++tick) supervise(kTiming, kFree, s);
    }
    return s.fault;
  };
  CHECK(fault_after(19, 0, 3) == Fault::none);
  CHECK(fault_after(19, 0, 4) == Fault::sparse_input);  // after 70 ms
  CHECK(fault_after(7, 0, 70) == Fault::sparse_input);  // after half a second
  CHECK(fault_after(6, 0, 10'000) == Fault::none);      // the force is held all the time
  CHECK(fault_after(19, 270, 100) == Fault::none);
  CHECK(fault_after(19, 200, 100) == Fault::sparse_input);
  // A chattering button forgives none; a calibration does.
  const auto thrice = [](SafetyInputs parked) {
    Supervisor s = after({{kRested, 1}, {kFree, 150}, {kSilent, 19}, {kFree, 1}, {kSilent, 19}});
    supervise(kTiming, parked, s);
    for (int tick = 0; tick < 19; ++tick) supervise(kTiming, tick == 0 ? kFree : kSilent, s);
    return s.fault;
  };
  CHECK(thrice(kParkBit) == Fault::sparse_input);
  CHECK(thrice(kRested) == Fault::none);
}

TEST_CASE("a rest elsewhere than at the dock is a fault, and forgives none") {
  constexpr SafetyInputs kElsewhere{.fresh = true, .parked = true, .misplaced = true};
  for (const int silent : {0, 30}) {
    Supervisor s = after({{kRested, 1}, {kFree, 150}, {kSilent, silent}, {kElsewhere, 1}});
    CHECK(s.fault == Fault::wrong_dock);
    for (int tick = 0; tick < 500; ++tick) supervise(kTiming, kFree, s);
    CHECK(s.phase == Phase::fault);
    supervise(kTiming, kRested, s);
    CHECK(s.phase == Phase::armed);
  }
}

TEST_CASE("the held force is whole up to 5 ms and gone at 20 ms, falling in between") {
  CHECK(stale_fraction(kTiming, 5) == kTiming.zero_ticks - kTiming.hold_ticks);
  CHECK(stale_fraction(kTiming, 20) == 0);
  for (std::uint32_t t = 5; t < 20; ++t) {
    CHECK(stale_fraction(kTiming, t + 1) < stale_fraction(kTiming, t));
  }
}

TEST_CASE("too fast, or not finite for more than 2 ms, ends the motors at once") {
  const SafetyInputs fast{.fresh = true, .overspeed = true};
  CHECK(after({{kRested, 1}, {kFree, 150}, {fast, 1}}).fault == Fault::overspeed);
  const SafetyInputs nan{.fresh = true, .finite = false};
  CHECK(after({{kRested, 1}, {kFree, 150}, {nan, 2}}).motors_on());
  CHECK(after({{kRested, 1}, {kFree, 150}, {nan, 3}}).fault == Fault::not_finite);
  CHECK(after({{kRested, 1}, {kFree, 150}, {nan, 2}, {kFree, 1}, {nan, 2}, {kFree, 1}, {nan, 2}})
            .motors_on());
}

TEST_CASE("every reachable state and input: only legal transitions, no motors with a fault") {
  // Breadth first over all inputs, with short timings so that the whole state space is visited.
  constexpr SafetyTiming kShort{.hold_ticks = 1,
                                .zero_ticks = 3,
                                .not_finite_ticks = 1,
                                .fade_in_ticks = 2,
                                .sparse_share = 2};
  const auto key = [](const Supervisor& s) {
    return std::array<std::uint32_t, 7>{static_cast<std::uint32_t>(s.phase),
                                        static_cast<std::uint32_t>(s.fault),
                                        s.started ? 1U : 0U,
                                        std::min(s.stale_ticks, 5U),
                                        std::min(s.not_finite_ticks, 4U),
                                        s.fade_ticks,
                                        s.sparse};
  };
  std::vector<Supervisor> states{Supervisor{}};
  std::vector<std::array<std::uint32_t, 7>> seen{key(states[0])};
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (const SafetyInputs& input : all_inputs()) {
      const Supervisor before = states[i];
      Supervisor s = before;
      supervise(kShort, input, s);
      REQUIRE((s.phase == Phase::fault) == (s.fault != Fault::none));
      REQUIRE_FALSE((s.motors_on() && s.fault != Fault::none));
      REQUIRE((!s.motors_on() || s.started));
      CAPTURE(before.phase);
      CAPTURE(s.phase);
      if (before.phase != s.phase) REQUIRE(is_legal(before, s.phase, input));
      if (input.fresh && !input.homed) REQUIRE_FALSE(s.motors_on());
      if (input.fresh && input.parked) REQUIRE_FALSE(s.motors_on());
      if (input.misplaced) REQUIRE(s.fault == Fault::wrong_dock);
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

}  // namespace kerf::supervisor_test
