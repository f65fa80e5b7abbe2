// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"

namespace kerf::accuracy {

/// `docs/accuracy.md`: what was asked, the figures of one run, what follows from them, and `plot`,
/// the picture's path from the page. Markdown. The sentences stand; every figure is of this run.
[[nodiscard]] std::string page(const std::vector<Entry>& entries, const std::string& plot);

/// A gnuplot script that draws errors against the time of a tick, both logarithmic: force and
/// direction against theory, work of closed loops, difference to double. Each choice is a point in
/// the colour of its knob; the line is the front, which no choice beats in both (by 1 % of error).
/// A label stands where there is room for it, those of the front first.
[[nodiscard]] std::string plot_script(const std::vector<Entry>& entries);

// All figures of a study, one row for each: knob, value, shape, metric, figure, unit, and the
// tick's us p50, p99, max.

[[nodiscard]] std::string csv(const std::vector<Entry>& entries);
/// With the core that it ran on.
[[nodiscard]] std::string json(const std::vector<Entry>& entries, int core);

}  // namespace kerf::accuracy
