// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/cast_job.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

/// `view` as the kernels take it, for a picture of `width` x `height` pixels.
[[nodiscard]] CastEye cast_eye(const View& view, std::int32_t width, std::int32_t height);

/// `from` into what the kernels read.
void put(float (&to)[3], const glm::dvec3& from);
/// [to][from], so that a row makes one part of a place.
void put(float (&to)[3][3], const glm::dmat3& from);

}  // namespace kerf
