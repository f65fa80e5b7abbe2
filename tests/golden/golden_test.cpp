// SPDX-License-Identifier: Apache-2.0
// 20 s of the servo step end in known bits: on every compiler, optimisation level, instruction set
// and processor (docs/determinism.md). Prints what .ci/check-determinism.sh compares.
#include <chrono>
#include <cstdio>
#include <string>

#include <doctest/doctest.h>

#include "tests/golden/golden_run.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

GoldenRun printed_run(const char* name, NumericKind numeric, const KernelSet& kernels) {
  const auto begin = std::chrono::steady_clock::now();
  const GoldenRun run = golden_run(numeric, kernels);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("golden %s %s %s %s %.2f\n", name, kernels.name, run.hash.c_str(),
              run.volume_hash.c_str(), took.count());
  return run;
}

/// A script that stops to meet what it was written for would be equal everywhere, and worthless.
void check_rich(const GoldenRun& run) {
  CHECK(run.contact_ticks > 6'000);
  CHECK(run.late_contact_ticks > 1'500);
  CHECK(run.stale_ticks > 100);
  CHECK(run.limited_ticks > 500);
  CHECK(run.motor_ticks > 15'000);
  CHECK(run.stale_faults == 1);
  CHECK(run.speed_faults == 1);
  CHECK(run.outings == 3);
  for (const std::uint64_t steps : run.removed_steps) CHECK(steps > 10'000'000);
}

}  // namespace

TEST_CASE("20 s in fixed point end in the known bits on every instruction set") {
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
    const GoldenRun run = printed_run("fixed", NumericKind::fixed, **set);
    CAPTURE(std::string((*set)->name));
    CHECK(run.hash == "13238c95e637973c");
    CHECK(run.volume_hash == "74b9e6fd06a55a59");
    check_rich(run);
  }
}

TEST_CASE("20 s in float and double end in the known bits") {
  const KernelSet& unused = **kernel_sets();
  const GoldenRun in_float = printed_run("float", NumericKind::float32, unused);
  CHECK(in_float.hash == "a885d50797a1eac8");
  CHECK(in_float.volume_hash == "0f56cf84df38d579");
  check_rich(in_float);
  const GoldenRun in_double = printed_run("double", NumericKind::float64, unused);
  CHECK(in_double.hash == "83ad2fdf7106bea7");
  CHECK(in_double.volume_hash == "a83c05782744d479");
  check_rich(in_double);
}
