// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "lab/zwidth/map/part_file.hpp"

namespace kerf::zwidth {

/// A script for gnuplot: one panel for each combination of the axes that are not mapped. With
/// stiffness mapped a panel shows the verdict of every cell and the boundaries over it, else the
/// highest stiffness of every cell.
[[nodiscard]] std::string plot_of(const Part& part);

/// Throws HilError for a map of more panels than a picture holds: before it is measured.
void check_panels(const MapSpec& spec);

}  // namespace kerf::zwidth
