// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/kernel/kernel_set.hpp"
#include "controller/scene/scene.hpp"

namespace kerf::test {

inline constexpr std::int32_t kGoldenTicks = 20'000;  ///< 20 s at 1 kHz

/// What a run ends in, and what it met on the way.
struct GoldenRun {
  std::string hash;         ///< over every figure of every tick's output, 16 hex digits
  std::string volume_hash;  ///< over the densities of all volumes at the end
  std::int32_t contact_ticks = 0, late_contact_ticks = 0;  ///< late: in the last quarter
  std::int32_t stale_ticks = 0, limited_ticks = 0, motor_ticks = 0;
  std::int32_t stale_faults = 0, speed_faults = 0, outings = 0;  ///< outings: force fades in
  std::uint64_t removed_steps[2] = {};                           ///< by volume
};

/// 20 000 ticks of a compiled scene in virtual time: two volumes, tools of both plans, a hand that
/// cuts, loses reports, runs into two faults and docks again.
///
/// Volumes, tools, joint counts and commands come from integers, so that only the loop and its
/// compiler decide about a bit of the result.
[[nodiscard]] GoldenRun golden_run(NumericKind numeric, const KernelSet& kernels);

}  // namespace kerf::test
