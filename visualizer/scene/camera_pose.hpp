// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <glm/glm.hpp>

#include "shared/segment/presented_view.hpp"

namespace kerf {

/// Where a picture is seen from, as users write it: the eye, the point in the middle of the
/// picture, which the camera turns about, and a direction that is upright in the picture. World
/// mm; `up` may have any length.
struct CameraPose {
  glm::dvec3 eye_mm{0.0, 0.0, 1.0};
  glm::dvec3 target_mm{0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};

  friend bool operator==(const CameraPose&, const CameraPose&) noexcept = default;
};

/// A pose as viewers present it, and back.
[[nodiscard]] PresentedView presented(const CameraPose& pose);
[[nodiscard]] CameraPose pose_of(const PresentedView& view);

/// What makes it none (`problem_in`), and the way out, as `value; way out`; empty for a camera.
[[nodiscard]] std::string problem_with(const CameraPose& pose);

/// Nine numbers with commas between: EYE,TARGET,UP. Throws VisualizerError.
[[nodiscard]] CameraPose parse_camera_numbers(std::string_view text);

/// Reads a camera from a file of TOML:
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
/// What --camera gives: numbers, or the name of a file. Throws VisualizerError.
[[nodiscard]] CameraPose read_camera(const std::string& given);

/// Writes such a file, whole or not at all, to a millionth of a mm. Throws FileError.
void write_camera(const std::filesystem::path& file, const CameraPose& pose);

}  // namespace kerf
