// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/stability/map.hpp"

namespace kerf::zwidth {

/// Phase portraits as JSON (lab/report/stability_map.py has its form): position of the tip and its
/// speed, one curve for each hit of each cell. `cells` are 1 to 12 texts "stiffness:damping" in
/// N/mm and N s/mm; all else is that of the map's one column. Throws HilError that names the
/// option.
[[nodiscard]] std::string portraits_of(const MapSpec& spec, const std::vector<std::string>& cells);

}  // namespace kerf::zwidth
