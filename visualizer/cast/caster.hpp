// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/camera.hpp"
#include "visualizer/cast/cast_volume.hpp"
#include "visualizer/cast/tile_pool.hpp"
#include "visualizer/palette.hpp"

namespace kerf {

enum class CastMode : std::uint8_t { iso, blend };

/// What the ray caster draws into. Rows from the bottom up, as GL has them.
struct CastPicture {
  std::int32_t width = 0, height = 0;
  std::vector<std::uint32_t> rgba;  ///< as `CastPixels::rgba`; 0 where nothing is
  std::vector<float> depth;         ///< window depth; 1 where nothing is (blend: too little)

  [[nodiscard]] PixelRect whole() const noexcept { return {0, 0, width, height}; }
  /// Its pixels are not kept.
  void resize(std::int32_t to_width, std::int32_t to_height);
};

/// Ray caster on the processor, for the volumes of one session: needs no GL, and gives the same
/// bits with every instruction set and any number of threads.
///
/// One caller at a time.
class Caster {
 public:
  struct Options {
    CastMode mode = CastMode::iso;
    float step_vox = 0.75F;  ///< a wall of one voxel, antialiased over two, is never stepped over
    const CastKernels* kernels = cast_kernels()[0];
    /// Blend: opacity over one voxel edge, by density (entry i is density i/255).
    std::array<float, kPaletteWidth> opacity{};
  };

  /// `density` and `labels` (or none) of each volume, whole. Throws VisualizerError.
  struct Content {
    std::span<const Density> density;
    std::span<const Label> labels;
  };
  Caster(const SceneView& scene, std::span<const Content> contents, const Options& options);

  /// Bricks `changed` of a volume are not what they were; `density` is all of it.
  void update(std::size_t volume, std::span<const Density> density,
              std::span<const std::uint32_t> changed);

  /// Draws `rect` of the picture; the rest of it stays. Rays of blend end at `end_depth` (window
  /// depth, one per pixel of the picture) where it is given. `normals` (three floats per pixel, or
  /// none) are those of iso in eye space, for measurements.
  void draw(const View& view, const PixelRect& rect, CastPicture& picture,
            std::span<const float> end_depth = {}, std::span<float> normals = {});

 private:
  Options options_;
  std::array<std::array<glm::vec4, kPaletteWidth>, 2> palette_;
  std::vector<CastVolume> volumes_;
  TilePool pool_;
};

/// Opacities under which a tooth shows its inside: enamel veils, dentin closes.
[[nodiscard]] std::array<float, kPaletteWidth> soft_opacity(double iso);

}  // namespace kerf
