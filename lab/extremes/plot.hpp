// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/extremes/comparison.hpp"
#include "lab/extremes/hand_run.hpp"

// Scripts for gnuplot that draw an SVG. Colours of Okabe and Ito, which differ for every kind of
// colour vision; the paper is dashed as well.
namespace kerf::extremes {

/// The paper's force and the swept proxy.
[[nodiscard]] std::string plot_of(const Comparison& comparison);
/// Height, force and removal of each hand.
[[nodiscard]] std::string plot_of(const std::vector<HandRun>& hands);

}  // namespace kerf::extremes
