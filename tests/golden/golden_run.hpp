// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/servo/servo_plan.hpp"
#include "tests/golden/golden_script.hpp"

namespace kerf::test {

/// What a run ends in, and what it met on the way.
struct GoldenRun {
  std::string hash;         ///< over every figure of every tick's output, 16 hex digits
  std::string volume_hash;  ///< over the densities of all volumes at the end
  std::int32_t contact_ticks = 0, late_contact_ticks = 0;  ///< late: in the last quarter
  std::int32_t stale_ticks = 0, limited_ticks = 0, motor_ticks = 0;
  std::int32_t forbidden_ticks = 0;
  std::int32_t stale_faults = 0, speed_faults = 0, outings = 0;  ///< outings: force fades in
  std::uint64_t removed_steps[2] = {};                           ///< by volume
  std::set<Method> methods;                                      ///< of all tools in all volumes
};

/// Made from integers alone, apart from the samples of `sweep`'s tools.
[[nodiscard]] LoadedScene golden_scene(GoldenScene which, NumericKind numeric);

/// A compiled scene in virtual time, under a hand that loses reports, runs into two faults and
/// docks again, as far as the scene's ticks go.
///
/// Volumes, tools, joint counts and commands come from integers, so that only the loop and its
/// compiler decide about a bit of the result.
[[nodiscard]] GoldenRun golden_run(GoldenScene which, NumericKind numeric,
                                   const KernelSet& kernels);

}  // namespace kerf::test
