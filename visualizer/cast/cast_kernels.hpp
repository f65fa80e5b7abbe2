// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// Most volumes: the segment has descriptors for this number.
inline constexpr int kMaxCastVolumes = static_cast<int>(kMaxVolumes);

/// Edge of the square blocks of pixels that share one `CastBlock`.
inline constexpr std::int32_t kCastBlock = 4;

/// Edge of the cells by which rays pass over what shows nothing. With cells of 4 rays of blend take
/// a sixth more samples, all of them in air, and with cells of 8 half as many again.
inline constexpr std::int32_t kCastCellVox = 2;

/// The rays of a block need only this stretch, as distance along the view axis; none of it if
/// begin is beyond end.
struct CastBlock {
  float begin_mm, end_mm;
};

/// `GradientRows` as the kernels see it.
struct CastGradient {
  const std::uint16_t* entries = nullptr;  ///< four for each voxel
  std::int32_t row = 0, plane = 0;         ///< in voxels
  float last[3] = {};                      ///< a hair before the far side of the border
  float per_edge[3] = {1.0F, 1.0F, 1.0F};  ///< `GradientPlan::per_edge`
};

/// One volume as the cast kernels see it: plain pointers, because their files are compiled for
/// instruction sets that other machines lack, and no inline function may be shared with them.
///
/// Positions are in voxel edges, counted from the border of air: voxel v is at v + 1.
struct CastVolumeJob {
  const std::uint32_t* density = nullptr;  ///< `PairedRows`
  const std::uint16_t* labels = nullptr;   ///< `PairedRows`, or none
  CastGradient gradient;
  const std::uint8_t* active = nullptr;  ///< of each macrocell: `Macrocells::active`
  const CastBlock* blocks = nullptr;     ///< `MacrocellDepthRange`: rows of the picture's blocks
  std::int32_t row = 0, plane = 0;       ///< of density and labels, in entries
  std::int32_t cell_row = 0, cell_plane = 0;
  float last[3] = {};          ///< a hair before the far side of the border
  float origin[3] = {};        ///< the eye
  float from_eye[3][3] = {};   ///< [to][from]: mm of eye space to voxel edges
  float square_edges[3] = {};  ///< mm^2 of a voxel, by axis
  /// 256 x linear RGB and, for blend, extinction: -log2 of the transparency of a mm.
  const float* by_density = nullptr;
  const float* by_label = nullptr;
  float settled = 1.0F;             ///< from this density on `by_density` stays what it is
  float empty = 0.0F, full = 1.0F;  ///< blend: densities of presence 0 and 1
  float surface_mm = 1.0F;          ///< blend: thickness of a lit layer (`kLitMm`)
  float iso = 0.5F;                 ///< 0..1
};

/// A picture and the eye that sees it. Eye space: x right, y up, rays along -z, in mm.
struct CastEye {
  std::int32_t width = 0, height = 0;
  float half_width_at_1mm = 0.25F, half_height_at_1mm = 0.25F;
  float middle_right_at_1mm = 0.0F;  ///< `View::middle_right`
  float near_mm = 1.0F, far_mm = 100.0F;
  float depth_far = 0.0F, depth_slope = 0.0F;      ///< equation (1): depth_far - depth_slope / t
  float clip_plane[4] = {0.0F, 0.0F, 0.0F, 1.0F};  ///< clip plane, of `View`
};

/// The picture that the kernels fill. Rows from the bottom up, as GL has them.
struct CastPixels {
  std::uint32_t* rgba = nullptr;     ///< sRGB and opacity (not multiplied in), red in the low byte
  float* depth = nullptr;            ///< window depth, equation (1); 1 if nothing was hit
  float* normal = nullptr;           ///< or none: x, y, z in eye space where iso hit something
  const float* end_depth = nullptr;  ///< or none: window depth at which rays of blend end
};

/// All that one picture needs.
struct CastJob {
  CastVolumeJob volumes[kMaxCastVolumes];
  int volume_count = 0;
  CastEye eye;
  CastPixels pixels;
  float step_mm = 0.1F;                                     ///< blend: along the view axis
  float key_light[3] = {}, fill_light[3] = {}, up[3] = {};  ///< unit vectors in eye space
};

struct RedrawJob;

/// The kernels of one instruction set. All sets give the same bits: every ray is computed by
/// itself, with the same operations in the same order, whatever packet it travels in.
struct CastKernels {
  const char* name;
  void (*iso)(const CastJob& job, const PixelRect& rect);
  void (*blend)(const CastJob& job, const PixelRect& rect);
  /// Whether a ray of `rect` crosses a changed cell, or ends in one.
  bool (*rays_touch)(const RedrawJob& job, const PixelRect& rect);
  /// Whether the shading of a surface point in `rect` samples a changed cell.
  bool (*shading_touches)(const RedrawJob& job, const PixelRect& rect);
};

/// What this machine can run and is not hidden (shared/numeric/hidden_set.hpp), the fastest first;
/// ends with the scalar set and a null.
[[nodiscard]] const CastKernels* const* cast_kernels() noexcept;

extern const CastKernels kCastAvx512;
extern const CastKernels kCastAvx512Gather;
extern const CastKernels kCastAvx2;
extern const CastKernels kCastScalar;

/// The footprint of a ray: a voxel farther from the ray than this, on any axis, has no part in the
/// ray's colour. In half voxel edges, by axis. It includes half an edge of slack, for rounding and
/// because rays are tested at discrete points.
struct RayFootprint {
  int along[3] = {};   ///< before the ray's end
  int at_end[3] = {};  ///< at the ray's end; 0: as before it. Else both are odd, or both even
};

/// Marks of the cells of a `RedrawJob`.
inline constexpr std::uint8_t kChangedAlong = 1;  ///< a ray that crosses the cell may have changed
inline constexpr std::uint8_t kChangedAtEnd = 2;  ///< a ray that ends in the cell may have changed

/// Where the shading of a surface point samples the volume for its material, in voxel edges along
/// its outward normal: the border that these pass is some voxels wide.
inline constexpr float kMaterialTapsVox[] = {-2.5F, -1.25F, 1.25F};

/// Where it samples for ambient occlusion, outwards in mm, so that a body looks the same in any
/// voxels. In those of 1/8 mm, as the default scene has them, these are 2.5, 6 and 12 edges.
///
/// The border of the surface itself must not darken it. A body that fills voxels in part, and is
/// interpolated between them, has a border with a standard deviation of half a voxel, whatever its
/// direction (a mean over one voxel and a tent over two: 1/12 + 1/6 = 1/4); it ends before 2.5
/// extents of a voxel along the normal. Nor do the voxels hold a gap narrower than that. So a tap
/// nearer than `kClearVox` extents loses weight, and has none at 2/3 of it, where the border is 3
/// deviations away; the longest is moved out, so that coarse voxels are shaded too.
inline constexpr int kOcclusionTaps = 3;
inline constexpr float kOcclusionTapsMm[kOcclusionTaps] = {0.3125F, 0.75F, 1.5F};
inline constexpr float kOcclusionWeights[kOcclusionTaps] = {0.30F, 0.30F, 0.25F};
inline constexpr float kClearVox = 2.5F;
/// No tap is farther away than this, so that the voxels that a change can darken stay few: it
/// shortens taps in voxels below 0.024 mm, and oblique ones if edges differ by more than 50 : 1.
inline constexpr float kMostTapVox = 64.0F;

/// Input of the kernels that test rays against the changed cells of a volume (`ChangedCells`):
/// plain pointers, as in `CastVolumeJob`. Positions are in voxel edges from the lowest corner of
/// the cells.
struct RedrawJob {
  CastEye eye;
  float origin[3] = {};         ///< the eye
  float from_eye[3][3] = {};    ///< [to][from]: mm of eye space to voxel edges
  float step_vox = 0.9F;        ///< between two tests, along the longest axis of a ray
  std::int32_t most_tests = 0;  ///< of one ray

  const std::uint8_t* cells = nullptr;  ///< marks, x fastest; 4 bytes can be read at the last one
  std::int32_t row = 0, plane = 0;
  float size[3] = {};  ///< cells along each axis
  float last[3] = {};  ///< the largest float below `size`

  /// Window depth at which rays end, row by row, of the pixels of `window`; null: rays go on.
  const float* depth = nullptr;
  PixelRect window;

  /// Of a volume whose surfaces sample it along their normals (`kOcclusionTapsMm`); else null.
  CastGradient gradient;
  float border[3] = {};        ///< position of the border's first voxel, (-1, -1, -1)
  float centre_mm[3] = {};     ///< of the marked cells, in eye space
  float half_mm[3][3] = {};    ///< half their edges, in eye space: [axis of the volume]
  float edge_mm = 1.0F;        ///< of a voxel, the longest
  float square_edges[3] = {};  ///< mm^2 of a voxel, by axis
  float tap_reach[3] = {};     ///< voxel edges that the samples of one direction reach, by axis
  float least_slope = 0.0F;    ///< per edge; the normal of a lower one is not known well enough
};

}  // namespace kerf
