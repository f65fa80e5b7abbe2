// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/ranges/key_study.hpp"

namespace kerf::ranges {

// Measurements of extremes that no test shows (extreme_rows.hpp): each tells what it found, and
// adds what broke. `keys`: what `study_keys` found.

using Found = std::vector<Violation>;

[[nodiscard]] std::string measure_stiffness(const Effort& effort, const std::vector<KeyRow>& keys,
                                            Found& found);
[[nodiscard]] std::string measure_damping(const Effort& effort, const std::vector<KeyRow>& keys,
                                          Found& found);
[[nodiscard]] std::string measure_voxel_sizes(const Effort& effort, const std::vector<KeyRow>& keys,
                                              Found& found);
[[nodiscard]] std::string measure_fields(const Effort& effort, const std::vector<KeyRow>& keys,
                                         Found& found);
[[nodiscard]] std::string measure_quantum(const Effort& effort, const std::vector<KeyRow>& keys,
                                          Found& found);
[[nodiscard]] std::string measure_denormals(const Effort& effort, const std::vector<KeyRow>& keys,
                                            Found& found);
[[nodiscard]] std::string measure_energy(const Effort& effort, const std::vector<KeyRow>& keys,
                                         Found& found);

}  // namespace kerf::ranges
