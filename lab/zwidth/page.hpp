// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "lab/zwidth/map/part_file.hpp"

namespace kerf::zwidth {

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
