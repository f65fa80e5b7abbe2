// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace kerf {

/// The shapes a [[tool]] can have, its tip (the lowest point of the head) toward -y and the shaft
/// toward +y. All but the mesh are solids of revolution about the y axis:
///
///   ball           a sphere
///   cylinder       flat at both ends
///   cone           pointed at the tip, widest at the shaft
///   inverted_cone  widest at the tip, 0.6 of that at the shaft
///   flame          a pointed ogive up to 0.6 of the length, then drawn in to half at the shaft
///   wheel          a flat disc whose rim is half of a torus as thick as the disc
///   stl            the mesh of a file
inline constexpr std::string_view kMeshShape = "stl";
inline constexpr std::array<std::string_view, 7> kShapeWords = {
    "ball", "cylinder", "cone", "inverted_cone", "flame", "wheel", kMeshShape};
inline constexpr auto kToolShapes = std::span(kShapeWords).first<6>();  ///< of revolution

/// What the scene says about the size of one tool; all in mm unless counted in pitches.
struct ToolSize {
  double pitch_mm = 0.125;                 ///< distance of the samples
  double radius_mm = 1.0;                  ///< largest radius; used when `size_vox` is empty
  std::optional<double> length_mm{};       ///< height of the head; not for a ball
  std::optional<std::int32_t> size_vox{};  ///< the head fills a cube of so many pitches
};

}  // namespace kerf
