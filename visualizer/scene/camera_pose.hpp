// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <glm/glm.hpp>

namespace kerf {

/// Where a picture is seen from, as users write it: the eye, the point in the middle of the
/// picture, which the camera turns about, and a direction that is upright in the picture. World
/// mm; `up` may have any length.
struct CameraPose {
  /// Farther off, a float of the shaders steps by more than 1/128 mm.
  static constexpr double kFarthestMm = 1e5;

  glm::dvec3 eye_mm{0.0, 0.0, 1.0};
  glm::dvec3 target_mm{0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};

  friend bool operator==(const CameraPose&, const CameraPose&) noexcept = default;
};

/// What of it is no camera, and the way out, as `value; way out`; empty for one that is: finite,
/// within `kFarthestMm`, with an eye beside the target and an `up` that is not along the view.
[[nodiscard]] std::string problem_with(const CameraPose& pose);

/// Nine numbers with commas between: EYE,TARGET,UP. Throws VisualizerError.
[[nodiscard]] CameraPose parse_camera_numbers(std::string_view text);

/// The same as a file of TOML:
///
///     [camera]
///     eye_mm = [12.5, 40, 33]
///     target_mm = [0, 0, 0]
///     up = [0, 1, 0]
///
/// Every mistake is a VisualizerError of one line: `name`, line, value, way out.
[[nodiscard]] CameraPose parse_camera(std::string_view text, const std::string& name);

/// Whether a value of --camera names a file: it has no comma, or it ends in .toml.
[[nodiscard]] bool is_camera_file(std::string_view given);
/// What --camera gives: numbers, or the name of a file. Throws as above.
[[nodiscard]] CameraPose read_camera(const std::string& given);

/// Writes such a file, whole or not at all, to a millionth of a mm. Throws FileError.
void write_camera(const std::filesystem::path& file, const CameraPose& pose);

}  // namespace kerf
