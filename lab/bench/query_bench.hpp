// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "lab/bench/kernel_bench.hpp"

namespace kerf {

/// Times one query of the swept contact, and one turn of its tool, on 256 x 256 x 161 voxels, in
/// this process on this core. The paper has no such thing: ratios divide the plain loop's time.
/// Takes some seconds.
[[nodiscard]] std::vector<KernelRow> bench_queries(
    const std::function<void(const KernelRow&)>& add_row);

}  // namespace kerf
