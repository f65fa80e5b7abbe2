// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "lab/extremes/measured_tools.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/rig/iso_rest.hpp"

namespace kerf::extremes {

void measure_isos(const Effort& effort, const RowSink& add_row) {
  constexpr double kMiddle = 0.45, kBump = 14;
  for (const EdgedTool& subject :
       {EdgedTool{"ball", tool_of_units("ball", 8, 16)}, edged_tools()[0], edged_tools()[1]}) {
    const SampledTool tool(subject.tool);
    const auto degrees_at = [&](double iso) {
      double most = 0;
      for (const double bump : {0.0, kBump}) {
        const IsoRests rests =
            rest_at_iso<FixedNumbers>(subject.tool, tool, iso, bump, effort.tilts);
        most = std::max(most, rests.degrees);
      }
      return most;
    };
    const double middle = degrees_at(kMiddle);
    for (const double iso : {0.02, 0.05, 0.1, 0.2, 0.3, kMiddle, 0.6, 0.7, 0.8, 0.95}) {
      char name[80];
      std::snprintf(name, sizeof name, "%s, iso %g: angle", subject.name, iso);
      add_row(
          {"isos", name, iso == kMiddle ? middle : degrees_at(iso), "deg", 1.5 * middle, middle});
    }
  }
}

}  // namespace kerf::extremes
