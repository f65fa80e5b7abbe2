// SPDX-License-Identifier: Apache-2.0

#include "visualizer/redraw/redraw_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/cast/cast_volume.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/surface/vertex_shading.hpp"

namespace kerf {

RedrawTiles::RedrawTiles(PictureSize size)
    : size_(size),
      across_((size.width + kEdge - 1) / kEdge),
      along_((size.height + kEdge - 1) / kEdge),
      marked_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(along_)) {}

PixelRect RedrawTiles::tiles_of(const PixelRect& pixels) const {
  const PixelRect in = pixels.clipped({0, 0, size_.width, size_.height});
  if (in.empty()) return {};
  return {in.x0 / kEdge, in.y0 / kEdge, (in.x1 - 1) / kEdge + 1, (in.y1 - 1) / kEdge + 1};
}

PixelRect RedrawTiles::pixels_of(const PixelRect& tiles) const {
  return PixelRect{tiles.x0 * kEdge, tiles.y0 * kEdge, tiles.x1 * kEdge, tiles.y1 * kEdge}.clipped(
      {0, 0, size_.width, size_.height});
}

void RedrawTiles::mark(const PixelRect& pixels) {
  const PixelRect tiles = tiles_of(pixels);
  for (int y = tiles.y0; y < tiles.y1; ++y) {
    for (int x = tiles.x0; x < tiles.x1; ++x) mark(x, y);
  }
}

void RedrawTiles::mark(const RedrawTiles& other) {
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), marked_.begin(),
                 std::bit_or<>());
}

RedrawTiles RedrawTiles::common(const RedrawTiles& other) const {
  RedrawTiles both(size_);
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), both.marked_.begin(),
                 [](auto a, auto b) { return static_cast<std::uint8_t>(a & b); });
  return both;
}

RedrawTiles RedrawTiles::without(const RedrawTiles& other) const {
  RedrawTiles rest(size_);
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), rest.marked_.begin(),
                 [](auto a, auto b) { return static_cast<std::uint8_t>(a & ~b); });
  return rest;
}

RedrawTiles RedrawTiles::take(double pixels) {
  RedrawTiles taken(size_);
  for (std::size_t i = 0; i < marked_.size() && pixels > 0.0; ++i) {
    if (marked_[i] == 0) continue;
    taken.marked_[i] = std::exchange(marked_[i], std::uint8_t{0});
    pixels -= kEdge * kEdge;
  }
  return taken;
}

double RedrawTiles::pixels() const {
  return static_cast<double>(std::count(marked_.begin(), marked_.end(), 1)) * kEdge * kEdge;
}

bool RedrawTiles::empty() const {
  return std::find(marked_.begin(), marked_.end(), 1) == marked_.end();
}

void RedrawTiles::clear() {
  std::fill(marked_.begin(), marked_.end(), std::uint8_t{0});
}

namespace {

constexpr int kSpareTiles = 4;  // that are drawn for nothing to save a rectangle

/// A rectangle of tiles that the next row may go on.
struct Open {
  PixelRect rect;
  bool alone;  ///< no other rectangle is in its rows: it may become wider
};

/// Whether `row`, which lies on `below`, takes it in.
bool takes_in(Open& row, const Open& below) {
  const PixelRect both = row.rect.united(below.rect);
  const bool same = row.rect.x0 == below.rect.x0 && row.rect.x1 == below.rect.x1;
  const bool near =
      row.alone && below.alone && both.area() <= row.rect.area() + below.rect.area() + kSpareTiles;
  if (!same && !near) return false;
  row = {both, row.alone && below.alone};
  return true;
}

}  // namespace

std::vector<PixelRect> RedrawTiles::rects() const {
  std::vector<PixelRect> done;
  std::vector<Open> open;
  for (int y = 0; y <= along_; ++y) {
    std::vector<Open> row;
    for (int x = 0; y < along_ && x < across_; ++x) {
      if (!marked(x, y)) continue;
      const int from = x;
      while (x < across_ && marked(x, y)) ++x;
      row.push_back({{from, y, x, y + 1}, true});
    }
    if (row.size() > 1) {
      for (Open& run : row) run.alone = false;
    }
    for (const Open& below : open) {
      const bool goes_on =
          std::any_of(row.begin(), row.end(), [&](Open& run) { return takes_in(run, below); });
      if (!goes_on) done.push_back(below.rect);
    }
    open = std::move(row);
  }
  for (PixelRect& rect : done) rect = pixels_of(rect);
  return done;
}

namespace {

/// Where a triangle may show.
struct Shown {
  PixelRect pixels;
  float nearest;  ///< window depth
};

constexpr float kSlackPx = 0.0625F;  // a GPU snaps corners to 1/16 pixel, or finer
constexpr float kSlackDepth = 1e-5F;

/// (x, y, z, w) at once; both compilers have it for every processor.
using Four = float __attribute__((vector_size(4 * sizeof(float))));

Four smaller(Four a, Four b) {
  return a < b ? a : b;
}
Four larger(Four a, Four b) {
  return a < b ? b : a;
}

/// From fine points to pixels and window depth, times w.
class WindowFromFine {
 public:
  WindowFromFine(const glm::dmat4& clip_from_voxel, const PixelRect& all) : all_(all) {
    const glm::dvec3 half(0.5 * all.x1, 0.5 * all.y1, 0.5);
    const glm::dmat4 window_from_clip =
        glm::translate(glm::dmat4(1.0), half) * glm::scale(glm::dmat4(1.0), half);
    const glm::mat4 matrix(window_from_clip * clip_from_voxel *
                           glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 / kFinePerVoxel)));
    for (int i = 0; i < 4; ++i) {
      column_[i] = Four{matrix[i].x, matrix[i].y, matrix[i].z, matrix[i].w};
    }
  }

  [[nodiscard]] Shown shown(const FineTriangle& triangle) const {
    // Far beyond the border it does not matter how far.
    const Four least{-1.0F, -1.0F, 0.0F, 0.0F};
    const Four most{static_cast<float>(all_.x1 + 1), static_cast<float>(all_.y1 + 1), 2.0F, 2.0F};
    Four low = most, high = least;
    int before_near = 0;
    for (const FinePoint& corner : triangle) {
      const Four at = static_cast<float>(corner.x) * column_[0] +
                      static_cast<float>(corner.y) * column_[1] +
                      static_cast<float>(corner.z) * column_[2] + column_[3];
      if (at[2] < 0.0F) {
        ++before_near;
        continue;
      }
      const Four window = smaller(larger(at / at[3], least), most);
      low = smaller(low, window);
      high = larger(high, window);
    }
    if (before_near == 3) return {{}, 1.0F};
    if (before_near > 0) return {all_, 0.0F};  // rarely: the surface touches the eye
    // Centres are at 0.5, 1.5, ...
    const auto below = [](float at) { return static_cast<int>(at + 2.0F) - 2; };  // at > -2
    const PixelRect pixels{below(low[0] + 0.5F - kSlackPx), below(low[1] + 0.5F - kSlackPx),
                           below(high[0] + 0.5F + kSlackPx), below(high[1] + 0.5F + kSlackPx)};
    // Seen on edge, what is rounded moves its depth by as much as it is deep.
    return {pixels.clipped(all_), low[2] - (high[2] - low[2]) - kSlackDepth};
  }

 private:
  PixelRect all_;
  Four column_[4];
};

}  // namespace

void mark_triangles(std::span<const FineTriangle> triangles, const KeptPicture& kept,
                    RedrawTiles& tiles) {
  if (triangles.empty()) return;
  const glm::dmat4 clip_from_voxel =
      kept.view.clip_from_eye() * kept.view.eye_from_world * kept.volume.world_from_voxel;
  const WindowFromFine window_from_fine(clip_from_voxel, kept.target.all());
  std::vector<Shown> shown;
  shown.reserve(triangles.size());
  PixelRect window;
  for (const FineTriangle& triangle : triangles) {
    shown.push_back(window_from_fine.shown(triangle));
    window = window.united(shown.back().pixels);
  }
  if (window.empty()) return;
  const std::vector<float> depth = kept.target.read_depth(window);
  const auto hidden = [&](const Shown& one, const PixelRect& pixels) {
    for (int y = pixels.y0; y < pixels.y1; ++y) {
      const auto first =
          depth.begin() + (y - window.y0) * (window.x1 - window.x0) + pixels.x0 - window.x0;
      if (std::any_of(first, first + (pixels.x1 - pixels.x0),
                      [&](float kept_depth) { return one.nearest <= kept_depth; })) {
        return false;
      }
    }
    return true;
  };
  for (const Shown& one : shown) {
    const PixelRect in = tiles.tiles_of(one.pixels);
    for (int y = in.y0; y < in.y1; ++y) {
      for (int x = in.x0; x < in.x1; ++x) {
        if (tiles.marked(x, y)) continue;
        const PixelRect pixels = tiles.pixels_of({x, y, x + 1, y + 1}).clipped(one.pixels);
        if (!hidden(one, pixels)) tiles.mark(x, y);
      }
    }
  }
}

ChangedCells::ChangedCells(std::span<const VoxelBox> voxels, const RayFootprint& footprint) {
  for (int axis = 0; axis < 3; ++axis) {
    reach_[axis] = std::max(footprint.along[axis], footprint.at_end[axis]);
  }
  const VoxelBox all = united(voxels);
  first_ = all.lo;
  low_ =
      glm::dvec3(first_.x, first_.y, first_.z) - 0.5 * glm::dvec3(reach_[0], reach_[1], reach_[2]);
  const VoxelIndex extent = all.extent();
  // Voxel centres at both ends.
  grid_ = {extent.x + reach_[0] - 1, extent.y + reach_[1] - 1, extent.z + reach_[2] - 1};
  marks_.resize(grid_.voxel_count() + sizeof(std::uint32_t));
  // The nearer ones last: they lie within the others.
  for (const VoxelBox& box : voxels) mark(box, footprint.at_end, kChangedAtEnd);
  for (const VoxelBox& box : voxels) mark(box, footprint.along, kChangedAlong | kChangedAtEnd);
}

glm::dvec3 ChangedCells::high() const noexcept {
  return low_ + glm::dvec3(grid_.nx, grid_.ny, grid_.nz);
}

void ChangedCells::mark(const VoxelBox& voxels, const int (&reach)[3], std::uint8_t marks) {
  if (reach[0] == 0) return;
  const auto inset = [&](int axis) { return (reach_[axis] - reach[axis]) / 2; };
  const VoxelIndex lo{voxels.lo.x - first_.x + inset(0), voxels.lo.y - first_.y + inset(1),
                      voxels.lo.z - first_.z + inset(2)};
  const VoxelIndex extent = voxels.extent();
  for (std::int32_t z = lo.z; z < lo.z + extent.z - 1 + reach[2]; ++z) {
    for (std::int32_t y = lo.y; y < lo.y + extent.y - 1 + reach[1]; ++y) {
      std::fill_n(&marks_[grid_.index(lo.x, y, z)], extent.x - 1 + reach[0], marks);
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
  for (int axis = 0; axis < 3; ++axis) {
    put(job.half_mm[axis], half[axis] * glm::dvec3(eye_from_voxel[axis]));
  }
  const glm::dvec3 edges_mm = kept.volume.edges_mm();
  const glm::dvec3 reach = VertexShading::tap_reach_vox(edges_mm);
  job.edge_mm = static_cast<float>(std::max({edges_mm.x, edges_mm.y, edges_mm.z}));
  put(job.square_edges, edges_mm * edges_mm);
  put(job.tap_reach, reach);
  // A texture unit may filter with 8 bits of weight. The gradient changes by 0.56 per edge at most
  // (farid5), so on a slope of 0.15 the normal of a shader is off by less than 1/24, half a voxel
  // at a sample twelve voxels away; farther ones need a steeper slope.
  const double farthest =
      std::min(std::max({reach.x, reach.y, reach.z, 12.0}), double{kMostTapVox});
  job.least_slope = static_cast<float>(0.15 * farthest / 12.0);
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
  const glm::dvec3 taps_vox =
      shading != nullptr ? VertexShading::tap_reach_vox(kept.volume.edges_mm()) : glm::dvec3(0.0);
  // The pixels whose rays may pass a box in voxel coordinates, or `vox` beside it.
  const auto pixels_around = [&](const glm::dvec3& low, const glm::dvec3& high,
                                 const glm::dvec3& vox) {
    return screen_bounds(box_corners(low - vox, high + vox, kept.volume.world_from_voxel),
                         kept.view, kept.target.size());
  };
  for (const std::vector<VoxelBox>& together : clusters_of(changed)) {
    if (const auto& [lo, hi] = together.front(); voxels_in({lo, hi}) > kMaxClusterVoxels) {
      glm::dvec3 reach;
      for (int axis = 0; axis < 3; ++axis) {
        reach[axis] = 0.5 * std::max(footprint.along[axis], footprint.at_end[axis]);
      }
      tiles.mark(pixels_around(glm::dvec3(lo.x, lo.y, lo.z) - reach,
                               glm::dvec3(hi.x, hi.y, hi.z) + reach, taps_vox));
      continue;
    }
    const ChangedCells cells(together, footprint);
    const PixelRect passing = tiles.tiles_of(pixels_around(cells.low(), cells.high(), {}));
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
