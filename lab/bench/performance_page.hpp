// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/bench/kernel_bench.hpp"

namespace kerf {

/// The part of `docs/performance.md` on kernels: the figures of one run with the machine, the
/// compiler, the day and the command that made them. Markdown.
[[nodiscard]] std::string performance_page(const std::vector<KernelRow>& rows,
                                           const std::vector<KernelRow>& queries,
                                           const std::vector<KernelRow>& layout);

}  // namespace kerf
