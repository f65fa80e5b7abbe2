// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "shared/text/toml.hpp"

namespace kerf {

/// A head of a dental bur: its number in ISO 6360-2, and the solid that it is.
struct BurHead {
  std::string_view number;  ///< three digits
  std::string_view name;
  std::string_view shape;  ///< one of kToolShapes
  int largest;             ///< diameter in tenths of a mm, whose head leaves a neck on kShankOutMm
};

/// The heads that a scene can name. Makers' heads differ in length: a bur has the proportions of
/// its shape, and length_mm changes them.
inline constexpr std::array<BurHead, 7> kBurHeads{{{"001", "round", "ball", 50},
                                                   {"010", "inverted cone", "inverted_cone", 50},
                                                   {"068", "wheel", "wheel", 50},
                                                   {"107", "fissure", "cylinder", 37},
                                                   {"165", "needle", "cone", 37},
                                                   {"237", "pear", "pear", 37},
                                                   {"249", "flame", "flame", 31}}};

inline constexpr int kSmallestBur = 5;  ///< diameter in tenths of a mm

/// Behind the head comes the neck of a friction-grip shank, which is 1.6 mm thick and 19 mm long
/// from the tip (ISO 1797, type 3), of which some 8 mm stand out of the handpiece. It is thinner
/// than the head it turns, so that it clears the cavity.
inline constexpr double kNeckOfHead = 0.6;
inline constexpr double kShankRadiusMm = 0.8;
inline constexpr double kShankOutMm = 8;

/// Gives each [[tool]] with a `bur = "001 014"` (head and size) the keys that it stands for: shape,
/// radius_mm, shaft_radius_mm, shaft_length_mm and a name, where the table has none of its own.
/// Throws SceneError for an unknown bur, and where the table names another shape or size too.
void spell_out_burs(TomlNode& root, const std::string& file);

}  // namespace kerf
