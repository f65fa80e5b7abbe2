// SPDX-License-Identifier: Apache-2.0
// The maps' loop of one axis against a simulation with mechanics, law, limits and a verdict written
// a second time, on random devices: 400 of them in the part `ranges` of .ci/all (KERF_DEVICES).
#include "tests/lab/second_simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "lab/stability/axes.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/one_axis.hpp"
#include "lab/stability/press.hpp"
#include "shared/text/text.hpp"

namespace kerf::second_simulation_test {
namespace {

namespace zwidth = kerf::zwidth;
namespace second = kerf::second_simulation;
using zwidth::AxisId;

constexpr double kSeconds = 60;
constexpr std::uint64_t kPhases = 40;  // of the encoder's steps, at a boundary

int devices_of_test(int standard) {
  const char* const wanted = std::getenv("KERF_DEVICES");
  return wanted != nullptr ? std::atoi(wanted) : standard;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}
  double any(double lowest, double highest) {
    return lowest + (highest - lowest) * static_cast<double>(bits_() >> 11) * 0x1p-53;
  }
  std::uint64_t phase() { return 1 + (bits_() >> 8); }

 private:
  std::mt19937_64 bits_;
};

/// The part of an encoder step by which a seed shifts the steps (splitmix64).
double part_of(std::uint64_t seed) {
  seed += 0x9E37'79B9'7F4A'7C15;
  seed = (seed ^ (seed >> 30)) * 0xBF58'476D'1CE4'E5B9;
  seed = (seed ^ (seed >> 27)) * 0x94D0'49BB'1331'11EB;
  return static_cast<double>((seed ^ (seed >> 31)) >> 11) * 0x1p-53;
}

void set(zwidth::Assignment& values, AxisId axis, double value) {
  values[zwidth::index_of(axis)] = format("%.7g", value);
}

/// From a stylus to a heavy arm, 0.5 to 4 kHz, up to three periods of delay.
zwidth::Assignment any_device(Random& random) {
  const auto doubled = [&](double lowest, double doublings) {
    return std::ldexp(lowest * random.any(1, 2), static_cast<int>(random.any(0, doublings)));
  };
  zwidth::Assignment values;
  set(values, AxisId::mass, doubled(0.03, 4));
  set(values, AxisId::viscous, random.any(0, 0.003));
  set(values, AxisId::friction, random.any(0, 0.5));
  set(values, AxisId::quantum, doubled(0.005, 5));
  set(values, AxisId::rate, std::ldexp(500, static_cast<int>(random.any(0, 4))));
  set(values, AxisId::delay, std::floor(random.any(0, 25)) / 8);
  set(values, AxisId::damping, random.any(0, 0.01));
  return values;
}

second::Axis axis_of(const zwidth::LoopCase& subject, double stiffness, std::uint64_t phase) {
  const SampledLoop& loop = subject.loop;
  return {.mass_kg = loop.mass_kg,
          .viscous_ns_per_mm = loop.viscous_ns_per_mm,
          .coulomb_n = loop.coulomb_n,
          .step_mm = loop.quantum_mm,
          .period_s = loop.period_s,
          .delay_64ths =
              static_cast<int>(std::lround(loop.delay_s / loop.period_s * second::Tip::kSteps)),
          .stiffness_n_per_mm = stiffness,
          .damping_ns_per_mm = subject.damping_ns_per_mm,
          .phase_mm = part_of(phase) * loop.quantum_mm};
}

zwidth::Press any_press(Random& random) {
  return {random.any(0.05, 2.9), random.any(0, 500), random.any(0, 2)};
}

second::Press of(const zwidth::Press& press) {
  return {press.push_n, press.hit_mm_per_s, press.start_mm};
}

TEST_CASE("what rests at random devices rests in another simulation, and what swings, swings") {
  const int devices = devices_of_test(8);
  Random random(72);
  zwidth::StepCounter ticks;
  int rests = 0, swings = 0, at_boundary = 0;
  for (int device = 0; device < devices; ++device) {
    const zwidth::LoopCase subject = zwidth::subject_of(any_device(random));
    const double stiffness = std::ldexp(0.1 * random.any(1, 2), static_cast<int>(random.any(0, 8)));
    const zwidth::Press press = any_press(random);
    const std::uint64_t first_phase = random.phase();
    if (subject.damping_ns_per_mm > highest_damping(subject.loop)) continue;
    CAPTURE(device);
    CAPTURE(stiffness);
    const auto here = [&](std::uint64_t phase) {
      return zwidth::hit_one_axis(subject, stiffness, press, kSeconds, phase, ticks);
    };
    const auto there = [&](std::uint64_t phase) {
      return second::oscillates(axis_of(subject, stiffness, phase), of(press), kSeconds);
    };
    const LimitCycle run = here(first_phase);
    const bool oscillates = there(first_phase);
    if (!run.rests() && !run.swings) continue;  // a creep: no statement
    ++(run.swings ? swings : rests);
    if (run.swings == oscillates) continue;
    ++at_boundary;
    bool is_boundary = false;
    for (std::uint64_t i = 1; i < kPhases && !is_boundary; ++i) {
      const std::uint64_t phase = first_phase + i;
      is_boundary = run.swings ? there(phase) : here(phase).swings;
    }
    CHECK(is_boundary);
  }
  MESSAGE(rests << " rest, " << swings << " oscillate; " << at_boundary
                << " differ, at a boundary");
  CHECK(rests >= devices / 8);
  CHECK(swings >= devices / 8);
}

TEST_CASE("the first stiffness of random devices is that of another simulation") {
  // Beside the first stiffness a run in hundreds oscillates, and each simulation meets others: the
  // crossings are compared, by steps that are wider than such an island.
  constexpr double kStep = 1.02, kLow = 0.85, kHigh = 1.25;
  const int devices = (devices_of_test(8) + 3) / 4;  // each is a search
  Random random(73);
  zwidth::StepCounter ticks;
  int crossings = 0, elsewhere = 0;
  double sum = 0;
  for (int device = 0; device < devices; ++device) {
    zwidth::Assignment values = any_device(random);
    const zwidth::Press press = any_press(random);
    set(values, AxisId::push, press.push_n);
    set(values, AxisId::hit, press.hit_mm_per_s);
    set(values, AxisId::start, press.start_mm);
    const zwidth::LoopCase subject = zwidth::subject_of(values);
    zwidth::MapSpec spec;
    spec.stiffness_n_per_mm = {0.05, 50};
    const zwidth::Column column = zwidth::measure_column(spec, values, ticks);
    const double first = column.swing.first_n_per_mm;
    if (column.cells.empty() || !(first > 0 && first < spec.stiffness_n_per_mm.back())) continue;
    ++crossings;
    const auto oscillates = [&](double stiffness) {
      for (std::uint64_t seed = 1; seed <= spec.seeds; ++seed) {
        const second::Axis axis = axis_of(subject, stiffness, seed << 32);
        if (second::oscillates(axis, of(press), kSeconds)) return true;
      }
      return false;
    };
    double there = kLow * first / kStep;
    const bool is_lower = oscillates(there);
    while (!is_lower && there < kHigh * first && !oscillates(there *= kStep)) continue;
    sum += there / first;
    if (!is_lower && there < kHigh * first) continue;
    ++elsewhere;
    MESSAGE("device " << device << ": " << first << " and " << there << " N/mm");
  }
  MESSAGE(crossings << " crossings, " << elsewhere << " elsewhere; mean ratio " << sum / crossings);
  CHECK(2 * crossings >= devices);
  CHECK(elsewhere <= crossings / 20);
  CHECK(sum / crossings == doctest::Approx(1).epsilon(0.05));
}

}  // namespace
}  // namespace kerf::second_simulation_test
