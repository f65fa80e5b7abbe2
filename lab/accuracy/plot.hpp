// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"

namespace kerf::accuracy {

/// A gnuplot script that draws errors against the time of a tick, both logarithmic: force and
/// direction against theory, work of closed loops, difference to double. Each choice is a point in
/// the colour of its knob; the line is the front, which no choice beats in both (by 1 % of error).
/// A label stands where there is room for it, those of the front first.
[[nodiscard]] std::string plot_script(const std::vector<Entry>& entries);

}  // namespace kerf::accuracy
