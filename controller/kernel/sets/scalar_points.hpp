// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"

// Sums and densities of a point shell as point_sums.hpp defines them, for sets without vectors of
// their own (point_vector.hpp). Internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

void sum_point_samples(const PointTable<FixedNumbers>& table,
                       const PointPositions<FixedNumbers>& places, const std::int32_t (&centre)[3],
                       const DensityField& field, PointSums<FixedNumbers>& sums) noexcept {
  sums = point_sums<FixedNumbers>(table, places, centre, field);
}

void read_point_samples(const PointPositions<FixedNumbers>& places, std::int32_t count,
                        const std::int32_t (&centre)[3], const DensityField& field,
                        std::int32_t* density) noexcept {
  read_points<FixedNumbers>(places, count, centre, field, density);
}

void sum_close_samples(const CloseSampleView<FixedNumbers>& look,
                       CloseSums<FixedNumbers>& sums) noexcept {
  sums = close_sums<FixedNumbers>(look);
}

}  // namespace
}  // namespace kerf
