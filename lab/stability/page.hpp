// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lab/stability/map.hpp"
#include "lab/stability/map_file.hpp"

/// The page of stability (docs/stability.md), and phase portraits.
namespace kerf::zwidth {

/// A script for gnuplot: phase portraits, the tip's position against its speed, one panel for each
/// cell and one curve for each hit. `cells` are 1 to 12 texts "stiffness:damping" in N/mm and N
/// s/mm; all else is that of the map's one column. Throws HilError that names the option.
[[nodiscard]] std::string portraits_of(const MapSpec& spec, const std::vector<std::string>& cells);

/// Measures a whole map: all columns of `spec`.
using Measure = std::function<Part(const MapSpec& spec, const std::string& what)>;

/// docs/stability.md and its pictures, as scripts for gnuplot.
struct StabilityPage {
  std::string text;
  std::string devices_plot, rates_plot;
};

/// Measures and writes the page; `devices` and `rates` are the file names of the pictures. `quick`:
/// few cells and short hits, for a test.
[[nodiscard]] StabilityPage stability_page(const Measure& measure, const std::string& devices,
                                           const std::string& rates, bool quick);

}  // namespace kerf::zwidth
