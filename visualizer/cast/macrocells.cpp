// SPDX-License-Identifier: Apache-2.0

#include "visualizer/cast/macrocells.hpp"

#include <algorithm>
#include <cmath>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

Macrocells::Macrocells(VoxelGrid volume, std::span<const Density> density, Density iso,
                       std::int32_t edge)
    : volume_(volume),
      edge_(edge),
      grid_{volume.nx / edge + 1, volume.ny / edge + 1, volume.nz / edge + 1},
      iso_(iso),
      active_(grid_.voxel_count()) {
  for_each_voxel(grid_.box(), [&](int x, int y, int z) { update_cell({x, y, z}, density); });
}

bool Macrocells::update_cell(VoxelIndex cell, std::span<const Density> density) {
  const std::int32_t half = edge_ / 2;
  const VoxelIndex lo{cell.x * edge_ - 1, cell.y * edge_ - 1, cell.z * edge_ - 1};
  const VoxelBox box =
      VoxelBox{lo, {lo.x + edge_ + 1, lo.y + edge_ + 1, lo.z + edge_ + 1}}.clipped(volume_.box());
  // A voxel in the middle belongs to the octants on both sides of it.
  const std::int32_t low_end = std::min(lo.x + half + 1, box.hi.x);
  const std::int32_t high_begin = std::min(lo.x + half, box.hi.x);
  unsigned octants = 0;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const Density* const row = density.data() + volume_.index(0, y, z);
      Density low = 0;
      Density high = 0;
      for (std::int32_t x = box.lo.x; x < low_end; ++x) low = std::max(low, row[x]);
      for (std::int32_t x = high_begin; x < box.hi.x; ++x) high = std::max(high, row[x]);
      const unsigned along_x = (low >= iso_ ? 1U : 0U) | (high >= iso_ ? 2U : 0U);
      const unsigned along_y =
          (y <= lo.y + half ? along_x : 0U) | (y >= lo.y + half ? along_x << 2 : 0U);
      octants |= (z <= lo.z + half ? along_y : 0U) | (z >= lo.z + half ? along_y << 4 : 0U);
    }
  }
  const std::size_t at = grid_.index(cell.x, cell.y, cell.z);
  const std::uint8_t before = active_[at];
  active_[at] = static_cast<std::uint8_t>(octants);
  return active_[at] != before;
}

VoxelBox Macrocells::update_bricks(const BrickGrid& bricks, const ChangedBricks& changed,
                                   std::span<const Density> density) {
  const std::int32_t per_brick = kBrickEdge / edge_;
  // Samples of a cell reach a voxel beyond it, so that bricks side by side share cells: each once.
  std::vector<std::size_t> touched;
  for (const ChangedBrick& brick : changed) {
    const VoxelIndex at = bricks.brick(brick.id);
    const auto beyond = [&](std::int32_t brick) { return (brick + 1) * per_brick + 1; };
    const VoxelBox cells = VoxelBox{
        {at.x * per_brick, at.y * per_brick, at.z * per_brick},
        {beyond(at.x), beyond(at.y),
         beyond(at.z)}}.clipped(grid_.box());
    for_each_voxel(cells, [&](int x, int y, int z) { touched.push_back(grid_.index(x, y, z)); });
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  VoxelBox flipped;
  for (const std::size_t cell : touched) {
    const auto i = static_cast<std::int32_t>(cell);
    const VoxelIndex at{i % grid_.nx, i / grid_.nx % grid_.ny, i / grid_.nx / grid_.ny};
    if (update_cell(at, density)) flipped = flipped.with(at);
  }
  return flipped;
}

std::vector<std::array<std::uint16_t, 4>> Macrocells::boundary_faces(const VoxelBox& cells) const {
  constexpr std::array<VoxelIndex, 6> kNeighbour{
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  const auto is_active = [this](VoxelIndex c) {
    return grid_.contains(c) && active_[grid_.index(c.x, c.y, c.z)] != 0;
  };
  std::vector<std::array<std::uint16_t, 4>> faces;
  for_each_voxel(cells, [&](int x, int y, int z) {
    if (!is_active({x, y, z})) return;
    for (std::size_t face = 0; face < kNeighbour.size(); ++face) {
      const VoxelIndex n = kNeighbour[face];
      if (is_active({x + n.x, y + n.y, z + n.z})) continue;
      faces.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                       static_cast<std::uint16_t>(z), static_cast<std::uint16_t>(face)});
    }
  });
  return faces;
}

namespace {

constexpr double kSlack = 1e-4;  // of a distance; and pixels: the kernels compute with 24 bits
constexpr CastBlock kEmpty{1e30F, 0.0F};

/// The planes through the eye and the sides of a rectangle of blocks, positive outside of it for
/// all of a cell whose lowest corner is taken.
std::array<glm::dvec4, 4> sides_of(const PixelRect& blocks, const glm::dmat4x3& pixel_from_cell) {
  const glm::dmat3x4 row = glm::transpose(pixel_from_cell);
  const auto pixel = [](std::int32_t block) { return static_cast<double>(block * kCastBlock); };
  std::array<glm::dvec4, 4> sides{
      (pixel(blocks.x0) - kSlack) * row[2] - row[0], row[0] - (pixel(blocks.x1) + kSlack) * row[2],
      (pixel(blocks.y0) - kSlack) * row[2] - row[1], row[1] - (pixel(blocks.y1) + kSlack) * row[2]};
  for (glm::dvec4& side : sides) {
    for (int axis = 0; axis < 3; ++axis) side.w += std::min(side[axis], 0.0);
  }
  return sides;
}

bool is_beside(const MacrocellDepthRange::Cell& cell, const std::array<glm::dvec4, 4>& sides) {
  return std::any_of(sides.begin(), sides.end(), [&](const glm::dvec4& side) {
    return cell[0] * side.x + cell[1] * side.y + cell[2] * side.z + side.w > 0.0;
  });
}

}  // namespace

void MacrocellDepthRange::draw(std::span<const Cell> cells, bool begin_inside,
                               const glm::dmat4& world_from_cell, const View& view,
                               std::int32_t width, std::int32_t height, const PixelRect& part) {
  const auto up = [](std::int32_t pixels) { return (pixels + kCastBlock - 1) / kCastBlock; };
  across_ = up(width);
  blocks_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(up(height)));
  drawn_ = {part.x0 / kCastBlock, part.y0 / kCastBlock, up(part.x1), up(part.y1)};
  for (std::int32_t y = drawn_.y0; y < drawn_.y1; ++y) {
    std::fill_n(blocks_.begin() + y * across_ + drawn_.x0, drawn_.x1 - drawn_.x0, kEmpty);
  }
  // x and y in pixels times the distance, which is z.
  glm::dmat4 pixel_from_eye(0.0);
  pixel_from_eye[0][0] = 0.5 * width / (view.tan_half_height * view.aspect);
  pixel_from_eye[1][1] = 0.5 * height / view.tan_half_height;
  pixel_from_eye[2] =
      glm::dvec4(pixel_from_eye[0][0] * view.middle_right - 0.5 * width, -0.5 * height, -1.0, 0.0);
  pixel_from_eye[3][3] = 1.0;
  const glm::dmat4x3 pixel_from_cell(pixel_from_eye * view.eye_from_world * world_from_cell);
  const std::array<glm::dvec4, 4> sides = sides_of(drawn_, pixel_from_cell);
  for (const Cell& cell : cells) {
    if (is_beside(cell, sides)) continue;
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
    // One beyond the far plane is kept: a ray that ends inside leaves through it.
    if (farthest_mm < view.near_mm) continue;
    if (nearest_mm < 0.5 * view.near_mm) {  // the eye may be inside: it is anywhere in the picture
      low = glm::dvec2(0.0);
      high = glm::dvec2(width, height);
    }
    const double begin_mm = begin_inside ? view.near_mm : nearest_mm * (1.0 - kSlack);
    cover(low - kSlack, high + kSlack,
          {static_cast<float>(begin_mm), static_cast<float>(farthest_mm * (1.0 + kSlack))});
  }
}

void MacrocellDepthRange::cover(const glm::dvec2& low, const glm::dvec2& high,
                                const CastBlock& range) {
  const auto block = [](double pixel, std::int32_t first, std::int32_t end) {
    return static_cast<std::int32_t>(
        std::clamp(std::floor(pixel / kCastBlock), first - 1.0, static_cast<double>(end)));
  };
  const std::int32_t x0 = std::max(block(low.x, drawn_.x0, drawn_.x1), drawn_.x0);
  const std::int32_t x1 = std::min(block(high.x, drawn_.x0, drawn_.x1), drawn_.x1 - 1);
  const std::int32_t y0 = std::max(block(low.y, drawn_.y0, drawn_.y1), drawn_.y0);
  const std::int32_t y1 = std::min(block(high.y, drawn_.y0, drawn_.y1), drawn_.y1 - 1);
  for (std::int32_t y = y0; y <= y1; ++y) {
    for (std::int32_t x = x0; x <= x1; ++x) {
      CastBlock& at = blocks_[static_cast<std::size_t>(y) * static_cast<std::size_t>(across_) +
                              static_cast<std::size_t>(x)];
      at.begin_mm = std::min(at.begin_mm, range.begin_mm);
      at.end_mm = std::max(at.end_mm, range.end_mm);
    }
  }
}

}  // namespace kerf
