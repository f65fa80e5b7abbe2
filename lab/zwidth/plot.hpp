// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/zwidth/one_axis.hpp"
#include "lab/zwidth/part_file.hpp"

namespace kerf::zwidth {

/// A script for gnuplot: one panel for each combination of the axes that are not mapped. With
/// stiffness mapped a panel shows the verdict of every cell and the boundaries over it, else the
/// highest stiffness of every cell. Throws HilError for more panels than a picture holds.
[[nodiscard]] std::string plot_of(const Part& part);

/// One cell of a phase portrait: a curve for each hit.
struct Portrait {
  std::string title;
  std::vector<std::vector<OneAxisTick>> hits;
};
[[nodiscard]] std::string plot_of(const std::vector<Portrait>& portraits);

/// What an axis is called in a picture, with its unit.
[[nodiscard]] std::string axis_label(std::size_t axis);

}  // namespace kerf::zwidth
