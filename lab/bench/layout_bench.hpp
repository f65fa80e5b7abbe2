// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "lab/bench/kernel_bench.hpp"

namespace kerf {

/// What the volume's place in memory costs a tick of the 16-voxel ball: the copy of its box out of
/// a linear volume and out of bricks of 8^3 voxels, warm and with the caches swept before each tick
/// (the baseline is the linear copy), and contact and milling in volumes from 128 x 128 x 80 to
/// 512^3 (the baseline is the smallest).
[[nodiscard]] std::vector<KernelRow> bench_layout(
    const std::function<void(const KernelRow&)>& add_row);

}  // namespace kerf
