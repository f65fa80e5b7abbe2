// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

namespace kerf {

/// Binds this process to the cores `cpus`. Where that is empty, binds it to all cores that it may
/// use but the last one, which is the servo's; to the only one where there is one. Call before any
/// other thread exists. Sets LP_NUM_THREADS, the number of threads of a software GL, unless it is
/// set.
///
/// Returns the cores taken. Throws VisualizerError where one of `cpus` is not to be had.
std::vector<int> place_process(std::span<const int> cpus);

}  // namespace kerf
