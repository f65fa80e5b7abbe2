// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf::burs {

/// An SVG drawing of every head of kBurHeads from the side, a row each, at the sizes that are sold
/// most, all at one scale, with their necks.
[[nodiscard]] std::string sheet_svg();

}  // namespace kerf::burs
