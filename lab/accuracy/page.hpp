// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"

namespace kerf::accuracy {

/// `docs/accuracy.md`: what was asked, the figures of one run, what follows from them, and `plot`,
/// the picture's path from the page. Markdown. The sentences stand; every figure is of this run.
[[nodiscard]] std::string page(const std::vector<Entry>& entries, const std::string& plot);

}  // namespace kerf::accuracy
