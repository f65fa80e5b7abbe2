// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace kerf {

/// A part of a tick: how often its innermost work is done, and what one of them costs on the
/// reference machine. What counts as one operation is told in the file of its method.
struct StageCost {
  const char* stage;
  std::uint64_t operations;
  double price_ns;
};

/// Work in us on the reference machine.
[[nodiscard]] double work_us(const StageCost& stage) noexcept;
[[nodiscard]] double work_us(const std::vector<StageCost>& stages) noexcept;

/// ns of one operation on the reference machine, a core of 2024 at 4.4 GHz, by what runs it;
/// rounded up from the costliest of many tools. 0 where a stage does not exist. NEON was never
/// measured on hardware: guesses, for slower cores.
struct Prices {
  double avx512, avx2, neon, scalar;
  double float32 = 0, float64 = 0;
};

/// A stage as `runs_it`, the name of a kernel set or a word of NumericKind, does it. Throws
/// std::logic_error where it has no price.
[[nodiscard]] StageCost priced(const char* stage, std::uint64_t operations, const Prices& prices,
                               std::string_view runs_it);

/// Where the swept proxy is felt: samples that are read, and what is counted like them
/// (query_work.hpp). They cost the same beside every method. The price is that of the costliest
/// ticks that `kerf lab extremes` finds, of tools of 500 to 1100 samples, and of queries inside of
/// the solid.
[[nodiscard]] StageCost query_stage(std::uint64_t samples, std::string_view runs_it);

/// Where force cuts, `list` and `spend`, the same beside every method: groups of voxels that the
/// tool covers (covered_bound.hpp), in float and double voxels, read with what they weigh; and the
/// same, from which the budget is taken, twice where the fullest have not enough.
void add_force_stages(std::uint64_t covered, std::string_view runs_it,
                      std::vector<StageCost>& stages);

}  // namespace kerf
