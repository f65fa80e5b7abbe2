// SPDX-License-Identifier: Apache-2.0

#include "visualizer/cast/cast_volume.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr float kMost = 0.996F;  // opacity; an opacity of 1 has no finite extinction
constexpr double kBorder = 1.0;  // voxels of air around the volume: voxel v is at v + 1

/// Samples of a lower density show nothing.
Density least_visible(CastMode mode, const VolumeView& volume, const TransferFunction& transfer) {
  if (mode == CastMode::iso) return volume.iso;
  return static_cast<Density>(std::max(1.0, std::floor(transfer.empty * kDensityMax)));
}

VoxelGrid checked(const VolumeView& volume) {
  const VoxelGrid& n = volume.bricks.grid;
  constexpr auto kLimit = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
  const std::size_t entries = GradientRows::entry_count(n);
  if (entries <= kLimit) return n;
  throw VisualizerError("volume " + volume.name + ": " + std::to_string(n.nx) + "x" +
                        std::to_string(n.ny) + "x" + std::to_string(n.nz) +
                        " voxels, and the ray caster takes " + std::to_string(kLimit) +
                        "; crop or resample it");
}

}  // namespace

CastVolume::CastVolume(const VolumeView& volume, const CastContent& content, CastMode mode,
                       GradientFilter filter)
    : bricks_(volume.bricks),
      world_from_voxel_(volume.world_from_voxel),
      transfer_(content.transfer),
      iso_(static_cast<float>(volume.iso / kDensityMax)),
      density_(checked(volume)),
      gradient_(GradientPlan(filter, volume.edges_mm()), volume.bricks.grid, content.density),
      cells_(volume.bricks.grid, content.density, least_visible(mode, volume, content.transfer),
             kCastCellVox) {
  set_materials(content.transfer.materials);
  active_.resize(cells_.active().size() + sizeof(std::uint32_t));
  take_cells(cells_.grid().box());
  density_.copy(bricks_.grid.box(), content.density);
  if (content.labels.empty()) return;
  labels_.emplace(bricks_.grid);
  labels_->copy(bricks_.grid.box(), content.labels);
}

void CastVolume::set_materials(const Palette& materials) {
  transfer_.materials = materials;
  for (auto& row : transfer_.materials) {
    for (glm::vec4& material : row) {
      material.w = -std::log2(1.0F - std::min(material.w, kMost)) / static_cast<float>(kOpacityMm);
    }
  }
  const auto& by_density = transfer_.materials[0];
  std::size_t first = by_density.size() - 1;
  while (first > 0 && by_density[first - 1] == by_density.back()) --first;
  settled_ = static_cast<float>(first) / static_cast<float>(by_density.size() - 1);
}

std::optional<BoxCorners> CastVolume::body() const {
  if (body_.empty()) return std::nullopt;
  const auto voxel = [](const VoxelIndex& cell) {
    return glm::dvec3(kCastCellVox * glm::ivec3(cell.x, cell.y, cell.z)) - kBorder;
  };
  return box_corners(voxel(body_.lo), voxel(body_.hi), world_from_voxel_);
}

void CastVolume::update_bricks(std::span<const Density> density, const ChangedBricks& changed) {
  for (const ChangedBrick& brick : changed) density_.copy(bricks_.voxels(brick.id), density);
  gradient_.update(changed, density);
  const VoxelBox flipped = cells_.update_bricks(bricks_, changed, density);
  if (!flipped.empty()) take_cells(flipped);
}

void CastVolume::take_cells(const VoxelBox& cells) {
  const VoxelGrid& grid = cells_.grid();
  for (std::int32_t z = cells.lo.z; z < cells.hi.z; ++z) {
    for (std::int32_t y = cells.lo.y; y < cells.hi.y; ++y) {
      const auto from =
          cells_.active().begin() + static_cast<std::ptrdiff_t>(grid.index(cells.lo.x, y, z));
      std::copy_n(from, cells.hi.x - cells.lo.x,
                  active_.begin() + (from - cells_.active().begin()));
    }
  }
  const VoxelBox near = cells.grown(1).clipped(grid.box());
  std::erase_if(outer_cells_, [&](const MacrocellDepthRange::Cell& cell) {
    return near.contains({cell[0], cell[1], cell[2]});
  });
  const auto first = static_cast<std::ptrdiff_t>(outer_cells_.size());
  for (const auto& [x, y, z, face] : cells_.boundary_faces(near)) outer_cells_.push_back({x, y, z});
  // The faces of a cell follow each other.
  outer_cells_.erase(std::unique(outer_cells_.begin() + first, outer_cells_.end()),
                     outer_cells_.end());
  body_ = {};
  for (const auto& [x, y, z] : outer_cells_) body_ = body_.with({x, y, z});
}

bool CastVolume::near_plane_is_inside(const View& view, const glm::dmat4& world_from_cell) const {
  const glm::dmat4 cell_from_eye = glm::affineInverse(view.eye_from_world * world_from_cell);
  glm::dvec3 low(1e30);
  glm::dvec3 high(-1e30);
  for (const double side : {-1.0, 1.0}) {
    for (const double end : {-1.0, 1.0}) {
      const double right = view.middle_right + side * view.aspect * view.tan_half_height;
      const glm::dvec3 corner = view.near_mm * glm::dvec3(right, end * view.tan_half_height, -1.0);
      const glm::dvec3 cell(cell_from_eye * glm::dvec4(corner, 1.0));
      low = glm::min(low, cell);
      high = glm::max(high, cell);
    }
  }
  const VoxelGrid& grid = cells_.grid();
  const auto index = [](double at, std::int32_t size) {  // all indices outside are alike
    return static_cast<std::int32_t>(std::clamp(std::floor(at), -2.0, size + 1.0));
  };
  const VoxelBox around =
      VoxelBox{{index(low.x, grid.nx), index(low.y, grid.ny), index(low.z, grid.nz)},
               {index(high.x, grid.nx) + 1, index(high.y, grid.ny) + 1, index(high.z, grid.nz) + 1}}
          .grown(1)  // the kernels compute in float
          .clipped(body_);
  for (std::int32_t z = around.lo.z; z < around.hi.z; ++z) {
    for (std::int32_t y = around.lo.y; y < around.hi.y; ++y) {
      const std::uint8_t* const row = active_.data() + grid.index(0, y, z);
      if (std::any_of(row + around.lo.x, row + around.hi.x, [](auto cell) { return cell != 0; })) {
        return true;
      }
    }
  }
  return false;
}

CastVolumeJob CastVolume::job(const View& view, std::int32_t width, std::int32_t height,
                              const PixelRect& part) {
  const glm::dmat4 world_from_border = glm::translate(world_from_voxel_, glm::dvec3(-kBorder));
  const glm::dmat4 world_from_cell = glm::scale(world_from_border, glm::dvec3(kCastCellVox));
  blocks_.draw(outer_cells_, near_plane_is_inside(view, world_from_cell), world_from_cell, view,
               width, height, part);
  const glm::dmat4 voxel_from_eye = glm::affineInverse(view.eye_from_world * world_from_border);
  CastVolumeJob job;
  job.density = density_.data();
  job.labels = labels_ ? labels_->data() : nullptr;
  job.gradient = gradient_.view();
  job.active = active_.data();
  job.blocks = blocks_.data();
  job.row = density_.row();
  job.plane = density_.plane();
  job.cell_row = cells_.grid().nx;
  job.cell_plane = cells_.grid().nx * cells_.grid().ny;
  job.by_density = &transfer_.materials[0][0].x;
  job.by_label = &transfer_.materials[1][0].x;
  job.settled = settled_;
  job.empty = static_cast<float>(transfer_.empty);
  job.full = static_cast<float>(transfer_.full);
  job.surface_mm = static_cast<float>(gradient_.plan().surface_mm + transfer_.border_mm);
  job.iso = iso_;
  std::copy_n(job.gradient.last, 3, job.last);
  put(job.origin, glm::dvec3(voxel_from_eye[3]));
  put(job.from_eye, glm::dmat3(voxel_from_eye));
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 edge(world_from_voxel_[axis]);
    job.square_edges[axis] = static_cast<float>(glm::dot(edge, edge));
  }
  return job;
}

CastEye cast_eye(const View& view, std::int32_t width, std::int32_t height) {
  CastEye eye;
  eye.width = width;
  eye.height = height;
  eye.half_width_at_1mm = static_cast<float>(view.tan_half_height * view.aspect);
  eye.half_height_at_1mm = static_cast<float>(view.tan_half_height);
  eye.middle_right_at_1mm = static_cast<float>(view.middle_right);
  eye.near_mm = static_cast<float>(view.near_mm);
  eye.far_mm = static_cast<float>(view.far_mm);
  // Equation (1) as depth_far - depth_slope / t.
  const double span_mm = view.far_mm - view.near_mm;
  eye.depth_far = static_cast<float>(view.far_mm / span_mm);
  eye.depth_slope = static_cast<float>(view.far_mm * view.near_mm / span_mm);
  // A plane is transformed by the transposed inverse.
  const glm::dvec4 plane =
      glm::transpose(glm::affineInverse(view.eye_from_world)) * view.clip_plane;
  for (int i = 0; i < 4; ++i) eye.clip_plane[i] = static_cast<float>(plane[i]);
  return eye;
}

void put(float (&to)[3], const glm::dvec3& from) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

void put(float (&to)[3][3], const glm::dmat3& from) {
  for (int i = 0; i < 3; ++i) put(to[i], glm::row(from, i));
}

}  // namespace kerf
