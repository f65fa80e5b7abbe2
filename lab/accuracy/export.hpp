// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"

namespace kerf::accuracy {

// All figures of a study, one row for each: knob, value, shape, metric, figure, unit, and the
// tick's us p50, p99, max.

[[nodiscard]] std::string csv(const std::vector<Entry>& entries);
/// With the core that it ran on.
[[nodiscard]] std::string json(const std::vector<Entry>& entries, int core);

}  // namespace kerf::accuracy
