// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/point_shell/close_sums.hpp"
#include "controller/kernel/point_shell/shell_sums.hpp"
#include "controller/kernel/sets/shell_places.hpp"

// Sums and densities of a shell as the plain loops that define them, for sets that need no
// instruction that other machines lack.

namespace kerf {
namespace {

void sum_shell_samples(const ShellTable<FixedNumbers>& table,
                       const ShellPlaces<FixedNumbers>& places, const std::int32_t (&centre)[3],
                       const ShellField& field, ShellSums<FixedNumbers>& sums) noexcept {
  sums = shell_sums<FixedNumbers>(table, places, centre, field);
}

void read_shell_samples(const ShellPlaces<FixedNumbers>& places, std::int32_t count,
                        const std::int32_t (&centre)[3], const ShellField& field,
                        std::int32_t* density) noexcept {
  read_shell<FixedNumbers>(places, count, centre, field, density);
}

void sum_close_samples(const ShellTable<FixedNumbers>& table, const std::int32_t* density,
                       CloseSums<FixedNumbers>& sums) noexcept {
  sums = close_sums<FixedNumbers>(table, density);
}

}  // namespace
}  // namespace kerf
