// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace kerf {

/// The shapes a [[tool]] can have. Every shape is a solid of revolution about the tool's y axis,
/// with its tip (the lowest point of the head) toward -y and the shaft toward +y:
///
///   ball           a sphere
///   cylinder       flat at both ends
///   cone           pointed at the tip, widest at the shaft
///   inverted_cone  widest at the tip, 0.6 of that at the shaft
///   flame          a pointed ogive up to 0.6 of the length, then drawn in to half at the shaft
///   wheel          a flat disc whose rim is half of a torus as thick as the disc
inline constexpr std::array<std::string_view, 6> kToolShapes = {
    "ball", "cylinder", "cone", "inverted_cone", "flame", "wheel"};

/// What the scene says about the size of one tool; all in mm unless counted in pitches.
struct ToolSize {
  double pitch_mm = 0.125;                 ///< distance of the samples
  double radius_mm = 1.0;                  ///< largest radius; used when `size_vox` is empty
  std::optional<double> length_mm{};       ///< height of the head; not for a ball
  std::optional<std::int32_t> size_vox{};  ///< the head fills a cube of so many pitches
};

/// The `shape` of a tool whose surface is a mesh instead of a solid of revolution.
inline constexpr std::string_view kMeshShape = "stl";

}  // namespace kerf
