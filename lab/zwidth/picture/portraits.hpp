// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/zwidth/map/map.hpp"

namespace kerf::zwidth {

/// A script for gnuplot: phase portraits, the tip's place against its speed, one panel for each
/// cell and one curve for each hit. `cells` are 1 to 12 texts "stiffness:damping" in N/mm and N
/// s/mm; all else is that of the map's one column. Throws HilError that names the option.
[[nodiscard]] std::string portraits_of(const MapSpec& spec, const std::vector<std::string>& cells);

}  // namespace kerf::zwidth
