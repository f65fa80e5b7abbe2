// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/extremes/comparison.hpp"
#include "lab/extremes/row.hpp"

namespace kerf::extremes {

/// `docs/contact.md`: the figures of one run with the machine, the compiler, the day and the
/// command that made them. `plot` and `hands_plot` are the pictures beside it. Markdown.
[[nodiscard]] std::string page(const std::vector<Row>& rows, const Comparison& comparison,
                               const std::string& plot, const std::string& hands_plot);

}  // namespace kerf::extremes
