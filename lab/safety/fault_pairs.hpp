// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/script/fault_script.hpp"
#include "lab/safety/emulated_program.hpp"

/// Two faults at once: the scripts of hil/faults in pairs, and each with a signal that asks the
/// controller to end. A pair has no contract of its own: every bound of either fault holds, and
/// where two differ the stricter one.
namespace kerf::faults {

/// A script under the name of its file; none: faults at random, other ones for each seed.
struct NamedScript {
  std::string name;
  std::optional<FaultScript> script{};
  std::size_t second_from = SIZE_MAX;       ///< of a pair: where the second script's faults begin
  std::optional<double> stop_s{};           ///< as in FaultCase
  ProgramWay program = ProgramWay::steady;  ///< as in FaultCase
};

/// One of `parts` equal parts of all pairs, from 1.
struct PairShare {
  std::size_t part = 1, parts = 1;
};

/// Reads "PART/PARTS", such as 3/40; nullopt for another text.
[[nodiscard]] std::optional<PairShare> pair_share_of(std::string_view text) noexcept;

/// The share of all pairs of the scripts that have faults, and of the signal with each of them, 10
/// ms after its first fault.
/// Every pair is in exactly one part.
[[nodiscard]] std::vector<NamedScript> pairs_of(const std::vector<NamedScript>& scripts,
                                                PairShare share);

/// What is played with a seed: of a pair the second script comes up to 40 ms later or 20 ms earlier
/// than it is written, so that either begins first.
[[nodiscard]] FaultScript played(const NamedScript& named, std::uint32_t seed);

}  // namespace kerf::faults
