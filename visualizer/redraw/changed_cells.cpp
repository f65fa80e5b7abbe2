// SPDX-License-Identifier: Apache-2.0

#include "visualizer/redraw/changed_cells.hpp"

#include <algorithm>
#include <cmath>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/cast/cast_volume.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

ChangedCells::ChangedCells(std::span<const VoxelBox> voxels, const RayFootprint& footprint)
    : reach_(std::max(footprint.along, footprint.at_end)) {
  const VoxelBox all = united(voxels);
  first_ = all.lo;
  low_ = glm::dvec3(first_.x, first_.y, first_.z) - 0.5 * reach_;
  const VoxelIndex extent = all.extent();
  const int more = reach_ - 1;  // voxel centres at both ends
  grid_ = {extent.x + more, extent.y + more, extent.z + more};
  marks_.resize(grid_.voxel_count() + sizeof(std::uint32_t));
  // The nearer ones last: they lie within the others.
  for (const VoxelBox& box : voxels) mark(box, footprint.at_end, kChangedAtEnd);
  for (const VoxelBox& box : voxels) mark(box, footprint.along, kChangedAlong | kChangedAtEnd);
}

glm::dvec3 ChangedCells::high() const noexcept {
  return low_ + glm::dvec3(grid_.nx, grid_.ny, grid_.nz);
}

void ChangedCells::mark(const VoxelBox& voxels, int reach, std::uint8_t marks) {
  if (reach == 0) return;
  const int inset = (reach_ - reach) / 2;
  const VoxelIndex lo{voxels.lo.x - first_.x + inset, voxels.lo.y - first_.y + inset,
                      voxels.lo.z - first_.z + inset};
  const VoxelIndex extent = voxels.extent();
  for (std::int32_t z = lo.z; z < lo.z + extent.z - 1 + reach; ++z) {
    for (std::int32_t y = lo.y; y < lo.y + extent.y - 1 + reach; ++y) {
      std::fill_n(&marks_[grid_.index(lo.x, y, z)], extent.x - 1 + reach, marks);
    }
  }
}

void ChangedCells::put(RedrawJob& job) const {
  job.cells = marks_.data();
  job.row = grid_.nx;
  job.plane = grid_.nx * grid_.ny;
  const std::int32_t cells[3] = {grid_.nx, grid_.ny, grid_.nz};
  const auto longest = static_cast<float>(std::max({grid_.nx, grid_.ny, grid_.nz}));
  job.most_tests = static_cast<std::int32_t>(longest / job.step_vox) + 3;
  for (int axis = 0; axis < 3; ++axis) {
    job.size[axis] = static_cast<float>(cells[axis]);
    job.last[axis] = std::nextafter(job.size[axis], 0.0F);
  }
}

namespace {

constexpr std::size_t kMaxBoxes = 8192;  // a few cuts between two pictures; more count as one box
// Voxels around the boxes that are tested together: those of a cut. Between boxes farther apart
// lies only air, and a larger cluster leaves out little.
constexpr std::size_t kMaxClusterVoxels = 64 * 64 * 64;

std::size_t voxels_in(const VoxelBox& box) {
  const VoxelIndex extent = box.extent();
  return VoxelGrid{extent.x, extent.y, extent.z}.voxel_count();
}

/// Groups of boxes that lie close together.
std::vector<std::vector<VoxelBox>> clusters_of(std::span<const VoxelBox> boxes) {
  std::vector<std::vector<VoxelBox>> clusters;
  std::vector<VoxelBox> around;
  for (const VoxelBox& box : boxes) {
    std::size_t at = 0;
    while (at < around.size() && voxels_in(around[at].united(box)) > kMaxClusterVoxels) ++at;
    if (at == around.size()) {
      around.emplace_back();
      clusters.emplace_back();
    }
    around[at] = around[at].united(box);
    clusters[at].push_back(box);
  }
  return clusters;
}

/// The changed cells of a volume, as one view sees them.
RedrawJob redraw_job(const ChangedCells& cells, const KeptPicture& kept) {
  const glm::dmat4 eye_from_cell =
      kept.view.eye_from_world * glm::translate(kept.volume.world_from_voxel, cells.low());
  const glm::dmat4 cell_from_eye = glm::affineInverse(eye_from_cell);
  const PictureSize size = kept.target.size();
  RedrawJob job;
  job.eye = cast_eye(kept.view, size.width, size.height);
  put(job.origin, glm::dvec3(cell_from_eye[3]));
  put(job.from_eye, glm::dmat3(cell_from_eye));
  cells.put(job);
  return job;
}

/// Adds the normals of surfaces whose shading samples the volume along them.
void put_gradient(RedrawJob& job, const GradientRows& gradient, const ChangedCells& cells,
                  const KeptPicture& kept) {
  job.gradient = gradient.view();
  put(job.border, -1.0 - cells.low());
  const glm::dmat4 eye_from_voxel = kept.view.eye_from_world * kept.volume.world_from_voxel;
  const glm::dvec3 half = 0.5 * (cells.high() - cells.low());
  put(job.centre_mm, glm::dvec3(eye_from_voxel * glm::dvec4(cells.low() + half, 1.0)));
  double edge_mm = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    put(job.half_mm[axis], half[axis] * glm::dvec3(eye_from_voxel[axis]));
    edge_mm = std::max(edge_mm, glm::length(glm::dvec3(eye_from_voxel[axis])));
  }
  job.edge_mm = static_cast<float>(edge_mm);
}

/// Marks the tiles of `within` that are not marked yet and for which `changes` holds.
template <class Changes>
void mark_if(RedrawTiles& tiles, const PixelRect& within, const Changes& changes) {
  for (int y = within.y0; y < within.y1; ++y) {
    for (int x = within.x0; x < within.x1; ++x) {
      if (!tiles.marked(x, y) && changes(tiles.pixels_of({x, y, x + 1, y + 1}))) tiles.mark(x, y);
    }
  }
}

}  // namespace

void mark_rays(std::span<const VoxelBox> changed, const RayFootprint& footprint, bool end_at_kept,
               const GradientRows* shading, const KeptPicture& kept, RedrawTiles& tiles) {
  const VoxelBox all_changed = united(changed);
  if (changed.size() > kMaxBoxes) changed = {&all_changed, 1};
  const CastKernels& kernels = *cast_kernels()[0];
  const double taps_vox = shading != nullptr ? kLongestTapVox : 0.0;
  // The pixels whose rays may pass a box in voxel coordinates, or `vox` beside it.
  const auto pixels_around = [&](const glm::dvec3& low, const glm::dvec3& high, double vox) {
    return screen_bounds(box_corners(low - vox, high + vox, kept.volume.world_from_voxel),
                         kept.view, kept.target.size());
  };
  for (const std::vector<VoxelBox>& together : clusters_of(changed)) {
    if (const auto& [lo, hi] = together.front(); voxels_in({lo, hi}) > kMaxClusterVoxels) {
      const double around_vox = 0.5 * std::max(footprint.along, footprint.at_end) + taps_vox;
      tiles.mark(pixels_around({lo.x, lo.y, lo.z}, {hi.x, hi.y, hi.z}, around_vox));
      continue;
    }
    const ChangedCells cells(together, footprint);
    const PixelRect passing = tiles.tiles_of(pixels_around(cells.low(), cells.high(), 0.0));
    const PixelRect all = tiles.tiles_of(pixels_around(cells.low(), cells.high(), taps_vox));
    if (all.empty()) continue;
    RedrawJob job = redraw_job(cells, kept);
    std::vector<float> depth;
    if (end_at_kept) {
      job.window = tiles.pixels_of(all);
      depth = kept.target.read_depth(job.window);
      job.depth = depth.data();
    }
    mark_if(tiles, passing, [&](const PixelRect& tile) { return kernels.rays_touch(job, tile); });
    if (shading == nullptr) continue;
    put_gradient(job, *shading, cells, kept);
    mark_if(tiles, all, [&](const PixelRect& tile) { return kernels.shading_touches(job, tile); });
  }
}

}  // namespace kerf
