// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "lab/zwidth/map/part_file.hpp"

namespace kerf::zwidth {

/// The analytic boundaries of a column, N/mm; 0: none is stable, or the bound is about another loop
/// (`quantum`: without delay and B). Of the linear loop, without the
/// limits, and with the backward difference whatever the subject's estimator.
struct Analytic {
  double exact, passive, quantum;
};
[[nodiscard]] Analytic analytic_of(const Subject& subject);

/// One row for each cell: all axes, then what was seen. A column that cannot exist has no rows.
[[nodiscard]] std::string csv_of(const Part& part);

/// The map: its axes, and for each column crossings, analytic boundaries and cells.
[[nodiscard]] std::string json_of(const Part& part);

}  // namespace kerf::zwidth
