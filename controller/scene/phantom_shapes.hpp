// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

namespace kerf {

/// What the phantom can be, in a box of 32 x 32 x 20 mm, z up:
///
///   molar          a lower molar of enamel, dentin and pulp
///   carious_molar  the same with a lesion below its fissures: a fourth label
///   wall           solid in the lower half of the box
///   ball           of 8 mm radius
///   torus          about z, ring of 10 mm, tube of 4 mm
///
/// The last three have no labels, and their surface at a density of 0.5.
inline constexpr std::string_view kMolar = "molar";
inline constexpr std::string_view kCariousMolar = "carious_molar";
inline constexpr std::array<std::string_view, 5> kPhantomShapes = {kMolar, kCariousMolar, "wall",
                                                                   "ball", "torus"};

}  // namespace kerf
