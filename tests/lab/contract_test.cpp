// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/contract.hpp"

#include <doctest/doctest.h>

using kerf::Phase;
using kerf::ServoOutput;
using kerf::faults::Contract;
using kerf::faults::Outcome;

namespace {

constexpr double kPeakN = 3.3;

ServoOutput pushing(double force_n) {
  ServoOutput output;
  output.motors_on = true;
  output.phase = Phase::active;
  output.force_n = {0, force_n, 0};
  return output;
}

/// Ticks of 1 ms.
struct Watched {
  Outcome outcome;
  Contract contract{1000, kPeakN, outcome};
  double time_ms = 0;

  void tick(const ServoOutput& output) { contract.tick(++time_ms, output); }
  /// Motors on without force until the fade is over, then up to `force_n` as fast as allowed.
  void push_up_to(double force_n) {
    for (int i = 0; i < 100; ++i) tick(pushing(0));
    for (double f = 0.5; f < force_n; f += 0.5) tick(pushing(f));
    tick(pushing(force_n));
  }
  /// A force, a fault, so many ms until too high a speed is latched, and the end.
  void end_latched(int after_ms, const char* latches) {
    push_up_to(1);
    contract.fault_begins(time_ms);
    for (int i = 1; i < after_ms; ++i) tick(pushing(1));
    ServoOutput off;
    off.phase = Phase::fault;
    off.fault = kerf::Fault::overspeed;
    tick(off);
    contract.end(time_ms, latches);
  }
};

}  // namespace

TEST_CASE("the contract accepts what it allows") {
  Watched run;
  run.push_up_to(3.3);
  ServoOutput stale = pushing(3.3);
  stale.stale = true;
  for (int i = 0; i < 5; ++i) run.tick(stale);  // held
  for (int i = 1; i <= 15; ++i) {
    stale.force_n[1] = 3.3 * (15 - i) / 15;
    run.tick(stale);
  }
  CHECK(run.outcome.violation_count == 0);
  CHECK(run.outcome.peak_n == doctest::Approx(3.3));
  CHECK(run.outcome.steepest_n_per_ms == doctest::Approx(0.5));
}

TEST_CASE("the contract sees each way to break it") {
  Watched run;
  SUBCASE("more than the peak") {
    run.push_up_to(3.3);
    run.tick(pushing(3.31));
  }
  SUBCASE("a rise of 0.6 N in a millisecond") {
    run.push_up_to(1);
    run.tick(pushing(1.6));
  }
  SUBCASE("a force held longer than 5 ms without reports") {
    run.push_up_to(2);
    ServoOutput stale = pushing(2);
    stale.stale = true;
    for (int i = 0; i < 7; ++i) run.tick(stale);
  }
  SUBCASE("a force that came back without fading in") {
    run.push_up_to(1);
    run.tick({});
    for (int i = 0; i < 10; ++i) run.tick(pushing(0));
    run.tick(pushing(0.5));
  }
  SUBCASE("motors on in a phase that forbids it") {
    ServoOutput output = pushing(0);
    output.phase = Phase::armed;
    run.tick(output);
  }
  SUBCASE("motors on with a fault") {
    ServoOutput output = pushing(0);
    output.fault = kerf::Fault::overspeed;
    run.tick(output);
  }
  SUBCASE("force with the motors off") {
    ServoOutput output;
    output.force_n = {0.1, 0, 0};
    run.tick(output);
  }
  SUBCASE("torque 3 ms after the motors went off") {
    run.push_up_to(1);
    run.tick({});
    run.contract.device_force(run.time_ms + 3, 1.0, true);
  }
  SUBCASE("the device pushes more than it was told") {
    run.push_up_to(3.3);
    run.contract.device_force(run.time_ms, 3.6, true);
  }
  SUBCASE("a fault that should be latched, and is not") {
    run.push_up_to(1);
    run.contract.end(run.time_ms, "overspeed");
  }
  SUBCASE("a fault that should not be latched") {
    run.end_latched(1, "none");
  }
  SUBCASE("another fault than the script says") {
    run.end_latched(1, "stale_input");
  }
  SUBCASE("a fault that is latched 3 ms after it began") {
    run.end_latched(3, "overspeed");
  }
  CHECK(run.outcome.violation_count > 0);
  CHECK_FALSE(run.outcome.violations.empty());
}

TEST_CASE("the contract accepts the fault that the script says, in time") {
  Watched run;
  run.end_latched(1, "overspeed");
  CHECK(run.outcome.violation_count == 0);
  CHECK(run.outcome.latched == "overspeed");
  CHECK(run.outcome.latch_ms == doctest::Approx(1));
}
