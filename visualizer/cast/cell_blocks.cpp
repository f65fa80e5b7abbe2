// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/cell_blocks.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

constexpr double kSlack = 1e-4;  // of a distance; and pixels: the kernels compute with 24 bits
constexpr CastBlock kEmpty{1e30F, 0.0F};

}  // namespace

void CellBlocks::draw(std::span<const Cell> cells, const glm::dmat4& world_from_cell,
                      const View& view, std::int32_t width, std::int32_t height) {
  across_ = (width + kCastBlock - 1) / kCastBlock;
  along_ = (height + kCastBlock - 1) / kCastBlock;
  blocks_.assign(static_cast<std::size_t>(across_) * static_cast<std::size_t>(along_), kEmpty);
  // x and y in pixels times the distance, which is z.
  glm::dmat4 pixel_from_eye(0.0);
  pixel_from_eye[0][0] = 0.5 * width / (view.tan_half_height * view.aspect);
  pixel_from_eye[1][1] = 0.5 * height / view.tan_half_height;
  pixel_from_eye[2] =
      glm::dvec4(pixel_from_eye[0][0] * view.middle_right - 0.5 * width, -0.5 * height, -1.0, 0.0);
  pixel_from_eye[3][3] = 1.0;
  const glm::dmat4x3 pixel_from_cell(pixel_from_eye * view.eye_from_world * world_from_cell);
  for (const Cell& cell : cells) {
    const glm::dvec3 corner = pixel_from_cell * glm::dvec4(cell[0], cell[1], cell[2], 1.0);
    glm::dvec2 low(1e30);
    glm::dvec2 high(-1e30);
    double nearest_mm = 1e30;
    double farthest_mm = -1e30;
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 at = corner + ((i & 1) != 0 ? pixel_from_cell[0] : glm::dvec3(0.0)) +
                            ((i & 2) != 0 ? pixel_from_cell[1] : glm::dvec3(0.0)) +
                            ((i & 4) != 0 ? pixel_from_cell[2] : glm::dvec3(0.0));
      nearest_mm = std::min(nearest_mm, at.z);
      farthest_mm = std::max(farthest_mm, at.z);
      low = glm::min(low, glm::dvec2(at) / at.z);
      high = glm::max(high, glm::dvec2(at) / at.z);
    }
    if (farthest_mm < view.near_mm || nearest_mm > view.far_mm) continue;
    if (nearest_mm < 0.5 * view.near_mm) {  // the eye may be inside: it is anywhere in the picture
      low = glm::dvec2(0.0);
      high = glm::dvec2(width, height);
    }
    cover(low - kSlack, high + kSlack,
          {static_cast<float>(nearest_mm * (1.0 - kSlack)),
           static_cast<float>(farthest_mm * (1.0 + kSlack))});
  }
}

void CellBlocks::cover(const glm::dvec2& low, const glm::dvec2& high, const CastBlock& range) {
  const auto block = [](double pixel, std::int32_t count) {
    return static_cast<std::int32_t>(
        std::clamp(std::floor(pixel / kCastBlock), -1.0, static_cast<double>(count)));
  };
  const std::int32_t x0 = std::max(block(low.x, across_), 0);
  const std::int32_t x1 = std::min(block(high.x, across_), across_ - 1);
  const std::int32_t y0 = std::max(block(low.y, along_), 0);
  const std::int32_t y1 = std::min(block(high.y, along_), along_ - 1);
  for (std::int32_t y = y0; y <= y1; ++y) {
    for (std::int32_t x = x0; x <= x1; ++x) {
      CastBlock& at = blocks_[static_cast<std::size_t>(y * across_ + x)];
      at.begin_mm = std::min(at.begin_mm, range.begin_mm);
      at.end_mm = std::max(at.end_mm, range.end_mm);
    }
  }
}

}  // namespace kerf
