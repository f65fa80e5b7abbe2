// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/point_shell/close_sums.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/sets/point_places.hpp"

// Sums and densities of a point shell as the plain loops that define them, for sets that need no
// instruction that other machines lack.

namespace kerf {
namespace {

void sum_point_samples(const PointTable<FixedNumbers>& table,
                       const PointPlaces<FixedNumbers>& places, const std::int32_t (&centre)[3],
                       const DensityField& field, PointSums<FixedNumbers>& sums) noexcept {
  sums = point_sums<FixedNumbers>(table, places, centre, field);
}

void read_point_samples(const PointPlaces<FixedNumbers>& places, std::int32_t count,
                        const std::int32_t (&centre)[3], const DensityField& field,
                        std::int32_t* density) noexcept {
  read_points<FixedNumbers>(places, count, centre, field, density);
}

void sum_close_samples(const PointTable<FixedNumbers>& table, const std::int32_t* density,
                       CloseSums<FixedNumbers>& sums) noexcept {
  sums = close_sums<FixedNumbers>(table, density);
}

}  // namespace
}  // namespace kerf
