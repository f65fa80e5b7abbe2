// SPDX-License-Identifier: Apache-2.0
// Three scenes of the servo step end in known bits: on every compiler, optimisation level,
// instruction set and processor (docs/determinism.md). Prints what .ci/check-determinism.sh
// compares.
#include <chrono>
#include <cstdio>
#include <set>
#include <string>

#include <doctest/doctest.h>

#include "controller/scene/scene.hpp"
#include "shared/text/text.hpp"
#include "tests/golden/golden_hash.hpp"
#include "tests/golden/golden_run.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::golden_test {

using namespace kerf::test;

namespace {

GoldenRun printed_run(GoldenScene scene, NumericKind numeric, const KernelSet& kernels) {
  const auto begin = std::chrono::steady_clock::now();
  const GoldenRun run = golden_run(scene, numeric, kernels);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("golden %s %s %s %s %s %.2f\n", name_of(scene), std::string(word_of(numeric)).c_str(),
              kernels.name, run.hash.c_str(), run.volume_hash.c_str(), took.count());
  return run;
}

/// Ends in the known bits; a failure prints the new ones.
void check_end(const GoldenRun& run, GoldenScene scene, NumericKind numeric) {
  const GoldenEnd known = golden_end(scene, numeric == NumericKind::fixed);
  CHECK(run.hash == hex64(known.hash));
  CHECK(run.volume_hash == hex64(known.volume_hash));
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

/// The same for the short scene: it is there for the contact of tools that turn.
void check_felt(const GoldenRun& run) {
  CHECK(run.methods == std::set{Method::gather});
  CHECK(run.contact_ticks > 1'000);
  CHECK(run.late_contact_ticks > 400);
  CHECK(run.motor_ticks > 2'000);
}

}  // namespace

TEST_CASE("20 s of milling in fixed point end in the known bits on every instruction set") {
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    const GoldenRun run = printed_run(GoldenScene::mill, NumericKind::fixed, **set);
    CAPTURE(std::string((*set)->name));
    check_end(run, GoldenScene::mill, NumericKind::fixed);
    CHECK(run.methods == std::set{Method::aligned, Method::splat});
    check_rich(run);
  }
}

TEST_CASE("20 s of milling in double end in the known bits") {
  const KernelSet& unused = **kernel_sets();
  const GoldenRun in_double = printed_run(GoldenScene::mill, NumericKind::float64, unused);
  check_end(in_double, GoldenScene::mill, NumericKind::float64);
  check_rich(in_double);
}

TEST_CASE("3 s of feeling in fixed point end in the known bits on every instruction set") {
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    const GoldenRun run = printed_run(GoldenScene::feel, NumericKind::fixed, **set);
    CAPTURE(std::string((*set)->name));
    check_end(run, GoldenScene::feel, NumericKind::fixed);
    check_felt(run);
  }
}

TEST_CASE("3 s of feeling in double end in the known bits") {
  const KernelSet& unused = **kernel_sets();
  const GoldenRun in_double = printed_run(GoldenScene::feel, NumericKind::float64, unused);
  check_end(in_double, GoldenScene::feel, NumericKind::float64);
  check_felt(in_double);
}

// In fixed point alone: a sine of the processor's own library puts the tools' samples where they
// are, and only rounding makes them the same everywhere.
TEST_CASE("3 s of cutting by the proxy's force end in the known bits on every instruction set") {
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    const GoldenRun run = printed_run(GoldenScene::sweep, NumericKind::fixed, **set);
    CAPTURE(std::string((*set)->name));
    check_end(run, GoldenScene::sweep, NumericKind::fixed);
    CHECK(run.methods == std::set{Method::aligned, Method::splat});
    for (const std::uint64_t steps : run.removed_steps) CHECK(steps > 1'000'000);
    CHECK(run.forbidden_ticks > 50);
    CHECK(run.contact_ticks > 1'000);
    CHECK(run.late_contact_ticks > 400);
    CHECK(run.motor_ticks > 2'000);
  }
}

}  // namespace kerf::golden_test
