// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/contact/comparison.hpp"
#include "lab/contact/hands.hpp"
#include "lab/contact/rows.hpp"

namespace kerf::extremes {

/// `docs/contact.md`: the figures of one run with the machine, the compiler, the day and the
/// command that made them. `plot` and `hands_plot` are links to its pictures. Markdown.
[[nodiscard]] std::string page(const std::vector<Row>& rows, const Comparison& comparison,
                               const std::string& plot, const std::string& hands_plot);

// Scripts for gnuplot that draw an SVG. Colours of Okabe and Ito, which differ for every kind of
// colour vision; the paper is dashed as well.

/// The paper's force and the swept proxy.
[[nodiscard]] std::string plot_of(const Comparison& comparison);
/// Height, force and removal of each hand.
[[nodiscard]] std::string plot_of(const std::vector<HandRun>& hands);

}  // namespace kerf::extremes
