// SPDX-License-Identifier: Apache-2.0
// What a device was led to before it was parked leaves no trace: the same reports give the same
// bits again, whatever fault, stop or mode came before.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include <doctest/doctest.h>

#include "controller/law/law.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/loop/publisher.hpp"
#include "tests/servo/two_arms_support.hpp"

namespace kerf::second_life_test {

using namespace kerf::test;

namespace {

constexpr int kFirstTicks = 700, kParkedTicks = 400;

bool within(int tick, int from, int ticks) {
  return tick >= from && tick < from + ticks;
}

/// The second life: takes the tool after a rest, hits the solid in two gaps of reports, goes on,
/// and is parked and taken again under force. As many gaps as a device that had none may have.
Hand second_life(int tick) {
  if (tick < kDockTicks) return {.parked = true};
  Hand hand = stroke(std::max(0, tick - 150));
  hand.parked = within(tick, 800, 3);
  hand.silent = within(tick, 300, 18) || within(tick, 319, 18) || within(tick, 338, 18) ||
                within(tick, 700, 3);
  return hand;
}
constexpr int kSecondTicks = 950;

struct FirstLife {
  const char* name;
  Hand (*at)(int tick);
  ServoCommand::Kind command = ServoCommand::Kind::none;  ///< in its middle, and undone at its end
};

Hand presses(int tick) {
  if (tick < kDockTicks) return {.parked = true};
  return stroke(std::clamp(tick - 150, 0, 380));
}

const std::array kFirstLives{
    FirstLife{"presses to the end", presses},
    FirstLife{"three gaps, just short of a fault",
              [](int tick) {
                Hand hand = presses(tick);
                hand.silent =
                    within(tick, 640, 18) || within(tick, 659, 18) || within(tick, 678, 18);
                return hand;
              }},
    FirstLife{"is lost at work",
              [](int tick) {
                Hand hand = presses(tick);
                hand.silent = tick >= 600;
                return hand;
              }},
    FirstLife{"is lost for less than a fault, to the end",
              [](int tick) {
                Hand hand = presses(tick);
                hand.silent = tick >= kFirstTicks - 12;
                return hand;
              }},
    FirstLife{"jumps",
              [](int tick) {
                Hand hand = presses(tick);
                if (tick == 650) hand.at[0] += 40;
                return hand;
              }},
    FirstLife{"moves fast to the end",
              [](int tick) {
                Hand hand = presses(tick);
                if (tick > 600) hand.at[0] += 5 * std::sin(tick);
                return hand;
              }},
    FirstLife{"loses its home",
              [](int tick) {
                Hand hand = presses(tick);
                hand.homed = !within(tick, 650, 20);
                return hand;
              }},
    FirstLife{"is taken again, and never fades in",
              [](int tick) {
                Hand hand = presses(tick);
                hand.parked = hand.parked || within(tick, 600, 20);
                return hand;
              }},
    FirstLife{"is held at work", presses, ServoCommand::Kind::hold},
    FirstLife{"stalls at work", presses, ServoCommand::Kind::fade_in},
    FirstLife{"works with another tool", presses, ServoCommand::Kind::select_tool},
    FirstLife{"undoes at work", presses, ServoCommand::Kind::undo},
};

/// All that is published of an arm in a tick, but for what counts from the start of a run: sums are
/// taken since the tick before.
TickRecord published(const Bench& bench, const std::array<ServoOutput, kMaxArms>& before,
                     std::size_t arm) {
  ServoOutput out = bench.out[arm];
  for (std::size_t i = 0; i < kEnergySources; ++i)
    out.energy_steps[i] -= before[arm].energy_steps[i];
  out.absorbed_mj = out.port_minimum_mj = 0;
  out.output_hash = 0;
  out.started = true;
  DeviceReport report = bench.reports[arm];
  report.counter = 0;
  return record_of(report, {}, out);
}

LoadedScene scene_of(const CutKind& kind, Personality first, Personality second,
                     const LawChoice& stabiliser, const LawChoice& velocity) {
  LoadedScene scene = two_armed(kind);
  scene.device.personality = first;
  scene.second->device.personality = second;
  if (kind.cut == CutModel::preston) scene.force.stiffness_n_per_mm = 1.5;
  scene.force.stabiliser = stabiliser;
  scene.servo.velocity = velocity;
  return scene;
}

void lead_first(Bench& bench, const FirstLife& life) {
  using enum ServoCommand::Kind;
  for (int tick = 0; tick < kFirstTicks; ++tick) {
    const bool begins = tick == 560;
    if (begins || (tick == kFirstTicks - 1 && life.command != undo)) {
      for (std::uint32_t arm = 0; arm < kMaxArms; ++arm) {
        const bool other = begins != (arm == 1);
        static_cast<void>(bench.servo->apply(
            {.kind = life.command,
             .argument = life.command == select_tool ? (other ? 1U : 0U) : (begins ? 1U : 0U),
             .arm = arm}));
      }
    }
    bench.step(life.at(tick), life.at(tick));
  }
  REQUIRE(bench.servo->apply({.kind = reset}));
  for (int tick = 0; tick < kParkedTicks; ++tick) bench.step({.parked = true}, {.parked = true});
  for (const ServoOutput& out : bench.out) REQUIRE(out.phase == Phase::armed);
  REQUIRE(bench.hash() == bench.first);
}

void check_all(const LoadedScene& scene) {
  for (const FirstLife& life : kFirstLives) {
    CAPTURE(std::string(life.name));
    Bench fresh(scene), again(scene);
    lead_first(again, life);
    int in_contact = 0;
    for (int tick = 0; tick < kSecondTicks; ++tick) {
      CAPTURE(tick);
      const auto fresh_before = fresh.out, again_before = again.out;
      const Hand one = second_life(tick), other = second_life(tick - 20);
      fresh.step(one, other);
      again.step(one, other);
      if (tick < kDockTicks + 20) continue;  // the one is calibrated already
      for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
        CAPTURE(arm);
        const TickRecord a = published(fresh, fresh_before, arm);
        const TickRecord b = published(again, again_before, arm);
        REQUIRE(length(again.out[arm].commanded_force_n) ==
                length(fresh.out[arm].commanded_force_n));
        REQUIRE(std::memcmp(&a, &b, sizeof a) == 0);
        REQUIRE(again.out[arm].changed == fresh.out[arm].changed);
        REQUIRE(again.out[arm].samples_read == fresh.out[arm].samples_read);
        in_contact += again.out[arm].contact ? 1 : 0;
        // In the air the proxy is at the hand from the first tick on.
        if (tick < 150) REQUIRE(length(again.out[arm].proxy_offset_mm) < 1e-3);
      }
    }
    CHECK(in_contact > 300);
    for (Bench* bench : {&fresh, &again}) {
      REQUIRE(bench->servo->apply({.kind = ServoCommand::Kind::undo}));
      for (int tick = 0; tick < 100; ++tick) bench->step({}, {});
    }
    CHECK(again.hash() == fresh.hash());
  }
}

}  // namespace

// In fixed point alone: in double the energies of a run round by their size.
TEST_CASE("a device that is parked and taken again begins as in a new run, whatever came before") {
  SUBCASE("cut by force, passivity") {
    check_all(scene_of(kCutKinds[0], Personality::omega, Personality::touch,
                       {LawKind::stabiliser, "passivity", {}}, {LawKind::velocity, "foaw", {}}));
  }
  SUBCASE("cut by force, energy bounding") {
    check_all(scene_of(kCutKinds[0], Personality::woodenhaptics, Personality::falcon,
                       {LawKind::stabiliser, "energy_bounding", {}},
                       {LawKind::velocity, "difference", {{"tau_ms", 5.0}}}));
  }
  SUBCASE("cut by overlap") {
    check_all(scene_of(kCutKinds[2], Personality::omega, Personality::touch,
                       {LawKind::stabiliser, "", {}},
                       {LawKind::velocity, "difference", {{"tau_ms", 5.0}}}));
  }
}

TEST_CASE("after a stall nothing of the force before it comes back, though reports stop") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    Bench bench(two_armed(kind));
    bench.dock();
    for (int tick = 0; tick < 400; ++tick) bench.step(stroke(tick), stroke(tick));
    for (int cycle = 0; cycle < 2; ++cycle) {
      CAPTURE(cycle);
      const auto before = bench.out;
      REQUIRE(bench.servo->apply({.kind = ServoCommand::Kind::fade_in}));
      for (int tick = 0; tick < 15; ++tick) {
        bench.step({.silent = true}, {.silent = true});
        for (const ServoOutput& out : bench.out) {
          REQUIRE(out.motors_on);
          REQUIRE(length(out.commanded_force_n) == 0);
        }
      }
      // Nor does the motion meanwhile count as work of that force.
      bench.step(stroke(410), stroke(410));
      for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
        CHECK(bench.out[arm].energy_steps == before[arm].energy_steps);
      }
      for (int tick = 0; tick < 300; ++tick) bench.step(stroke(410), stroke(410));
    }
  }
}

TEST_CASE("a hold leaves no trace: the force comes back as to a hand that never pressed before") {
  for (const CutKind& kind : kCutKinds) {
    CAPTURE(std::string(kind.name));
    LoadedScene scene = two_armed(kind);
    scene.cut.model = CutModel::none;
    scene.force.stabiliser = {LawKind::stabiliser, "passivity", {}};
    Bench pressed(scene), came(scene);
    const auto hold = [&](std::uint32_t on) {
      for (Bench* bench : {&pressed, &came}) {
        REQUIRE(bench->servo->apply({.kind = ServoCommand::Kind::hold, .argument = on}));
      }
    };
    pressed.dock();
    came.dock();
    // Both come down by the same way; the second under a hold from the start.
    REQUIRE(came.servo->apply({.kind = ServoCommand::Kind::hold, .argument = 1}));
    for (int tick = 0; tick < 200; ++tick) {
      pressed.step(stroke(tick), stroke(tick));
      came.step(stroke(tick), stroke(tick));
    }
    for (int from = 200; from < 600; from += 200) {  // two cycles
      CAPTURE(from);
      hold(1);
      for (int tick = 0; tick < 300; ++tick) {
        pressed.step(stroke(from), stroke(from));
        came.step(stroke(from), stroke(from));
        for (const ServoOutput& out : pressed.out) REQUIRE(length(out.commanded_force_n) <= 0.51);
      }
      hold(0);
      for (int tick = 0; tick < 200; ++tick) {
        pressed.step(stroke(from + tick), stroke(from + tick));
        came.step(stroke(from + tick), stroke(from + tick));
        for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
          REQUIRE(pressed.out[arm].commanded_force_n == came.out[arm].commanded_force_n);
          REQUIRE(pressed.out[arm].velocity_mm_per_s == came.out[arm].velocity_mm_per_s);
          // The spring of a proxy grows by 0.1 N a ms, from nothing on.
          if (kind.cut == CutModel::preston) {
            REQUIRE(length(pressed.out[arm].contact_force_n) <= 0.1 * (tick + 1) + 0.02);
          }
        }
      }
    }
    CHECK(length(pressed.out[0].commanded_force_n) > 0.03);
  }
}

namespace {

/// A law that begins anew gives the bits of one that has never run, whatever it was fed before.
template <template <class> class In, class N, class MakeInput>
void check_begins_anew(const LawChoice& choice, const MakeInput& input) {
  using Output = typename In<N>::Output;
  const LawPlan<In<N>> plan = plan_law<In, N>(choice, {.rate_hz = 1000, .tip_noise_mm = 0.01});
  LawMemory used;
  for (int cycle = 0; cycle < 3; ++cycle) {
    for (int i = 0; i < 300; ++i) static_cast<void>(plan(used, input(i, true)));
    used.begin_anew();
    LawMemory fresh;
    for (int i = 0; i < 300; ++i) {
      CAPTURE(i);
      const Output again = plan(used, input(i, false)), first = plan(fresh, input(i, false));
      REQUIRE((again.x == first.x && again.y == first.y && again.z == first.z));
    }
    used.begin_anew();
  }
}

template <class N>
void check_laws() {
  using Real = typename N::Real;
  const auto wave = [](int i, double by) {
    return DeviceVec<Real>{Real(by * std::sin(0.1 * i)), Real(by * std::cos(0.07 * i)), Real(0)};
  };
  // Active at first, which leaves a deficit; then quiet.
  const auto stabiliser = [&](int i, bool active) {
    StabiliserInput<N> in;
    in.wanted_n = wave(i, active ? 2 : 0.5);
    in.sent_n = wave(i - 1, active ? 2 : 0.5);
    in.moved_mm = wave(i + 5, active ? 0.5 : 0.01);
    in.velocity_mm_per_s = wave(i + 5, active ? 500 : 10);
    in.taken_mj = static_cast<typename N::Energy>((active ? -1.0 - 0.05 * i : 0.001 * i) *
                                                  (N::kIsFixed ? kEnergyStepsPerMj : 1));
    in.contact = i > 20;
    return in;
  };
  for (const char* const name : {"passivity", "energy_bounding"}) {
    CAPTURE(std::string(name));
    check_begins_anew<StabiliserInput, N>({LawKind::stabiliser, name, {}}, stabiliser);
  }
  const auto tip = [&](int i, bool active) {
    return VelocityInput<N>{wave(i, active ? 50 : 1), active && i % 9 == 0 ? 7U : 1U,
                            !active && i == 0};
  };
  check_begins_anew<VelocityInput, N>({LawKind::velocity, "foaw", {}}, tip);
  check_begins_anew<VelocityInput, N>({LawKind::velocity, "difference", {{"tau_ms", 20.0}}}, tip);
}

}  // namespace

TEST_CASE("a law that begins anew remembers nothing of what it was fed before") {
  check_laws<FixedNumbers>();
  check_laws<DoubleNumbers>();
}

}  // namespace kerf::second_life_test
