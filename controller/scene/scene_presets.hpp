// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene.hpp"
#include "shared/text/toml.hpp"

// Materials and dental burs that a scene names instead of describing them.

namespace kerf {

/// The default material table: index 0 none, then enamel, dentin and pulp, as the phantom's labels.
/// Load time.
[[nodiscard]] std::vector<Material> default_materials();

/// Properties of a material by its name: enamel, dentin, pulp, bone, caries, amalgam; plain values
/// for another name. docs/cutting.md has the sources, and which values are tuned. Load time.
[[nodiscard]] Material known_material(std::string_view name);

/// The material of a label in a map of labels alone, if it has none: "label 4", plain values, a
/// colour unlike those of its neighbours, drawn from density `iso` on. Load time.
[[nodiscard]] Material label_material(std::size_t label, double iso);

/// A head of a dental bur: its number in ISO 6360-2, and its solid.
struct BurHead {
  std::string_view number;  ///< three digits
  std::string_view name;
  std::string_view shape;  ///< one of kToolShapes
  int largest;  ///< diameter in tenths of a mm; its head leaves a neck within kShankOutMm
};

/// The heads that a scene can name. Heads of makers differ in length: here a bur has the
/// proportions of its shape, and length_mm changes them.
inline constexpr std::array<BurHead, 7> kBurHeads{{{"001", "round", "ball", 50},
                                                   {"010", "inverted cone", "inverted_cone", 50},
                                                   {"068", "wheel", "wheel", 50},
                                                   {"107", "fissure", "cylinder", 37},
                                                   {"165", "needle", "cone", 37},
                                                   {"237", "pear", "pear", 37},
                                                   {"249", "flame", "flame", 31}}};

inline constexpr int kSmallestBur = 5;  ///< diameter in tenths of a mm

/// Behind the head comes the neck of a friction-grip shank, which is 1.6 mm thick and 19 mm long
/// from the tip (ISO 1797, type 3), of which some 8 mm protrude from the handpiece. It is thinner
/// than the head it turns, so that it clears the cavity.
inline constexpr double kNeckOfHead = 0.6;
inline constexpr double kShankRadiusMm = 0.8;
inline constexpr double kShankOutMm = 8;

/// Gives each [[tool]] with a `bur = "001 014"` (head and size) the keys of that bur: shape,
/// radius_mm, shaft_radius_mm, shaft_length_mm and a name, unless the table has its own. Throws
/// LoadError for an unknown bur, and if the table names a shape or a size beside it.
void spell_out_burs(TomlNode& root, const std::string& file);

/// The law of a diamond grit; docs/cutting.md has the sources. Load time.
[[nodiscard]] BurLaw grit_law(Grit grit);

}  // namespace kerf
