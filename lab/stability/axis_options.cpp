// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/axis_options.hpp"

namespace kerf::zwidth {

void AxisOptions::declare(Arguments& app, std::span<const AxisId> axes) {
  for (const AxisId axis : axes) {
    const std::size_t i = index_of(axis);
    const AxisKind& kind = axis_kinds()[i];
    std::string meaning = kind.meaning;
    if (*kind.standard != 0) meaning += std::string(" [") + kind.standard + "]";
    names_[i] = std::string("--") + kind.name;
    app.option(names_[i].c_str(), texts[i], meaning)
        .shown_as(*kind.unit != 0 ? kind.unit : "VALUE");
  }
  app.option("--direction", direction,
             "of a --device that is a file of kerf identify: x, y, z, such as 1,0,1, or worst "
             "[worst]")
      .shown_as("N");
}

}  // namespace kerf::zwidth
