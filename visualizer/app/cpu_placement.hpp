// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

namespace kerf {

/// Keeps this process off the servo's core, before any thread exists: onto `cpus`, or where that is
/// empty onto every core it may use but the last one (all of them where there is only one). A
/// software GL is told to start no more threads than that, unless LP_NUM_THREADS says otherwise.
///
/// Returns the cores taken. Throws VisualizerError where one of `cpus` is not to be had.
std::vector<int> place_process(std::span<const int> cpus);

}  // namespace kerf
