// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>

#include "lab/zwidth/map/part_file.hpp"
#include "lab/zwidth/picture/panels.hpp"

namespace kerf::zwidth {

inline constexpr int kLegendHeight = 150;  ///< pixels: the foot of a map's picture

/// What is the same in all panels: the foot's last line. `varies_too`: an axis that has one value
/// in the map and others in the picture.
[[nodiscard]] std::string foot_of(const MapSpec& spec, AxisId varies_too);
[[nodiscard]] std::string foot_of(const MapSpec& spec);

/// Under the panels: what colours and lines mean, drawn with the next of them. `verdicts`: the
/// panels show those of each cell, else its highest stiffness.
void draw_legend(std::ostream& script, const Part& part, bool verdicts, const PanelLayout& layout);

}  // namespace kerf::zwidth
