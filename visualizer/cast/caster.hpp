// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <thread>
#include <vector>

#include "visualizer/cast/cast_volume.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

/// Threads that share out numbered pieces of work, as many as this process has cores when the pool
/// is made: `place_process` has taken the servo's core away by then. The caller works too, so one
/// core needs no thread.
class TilePool {
 public:
  /// `workers` beside the caller; by default one less than the cores.
  explicit TilePool(int workers = default_workers());
  TilePool(const TilePool&) = delete;
  TilePool& operator=(const TilePool&) = delete;
  ~TilePool();

  /// Calls `work(i)` once for each i in 0..count-1, on any thread, and returns after the last. One
  /// caller at a time; `work` must not throw.
  void run(std::uint32_t count, const std::function<void(std::uint32_t)>& work);

 private:
  [[nodiscard]] static int default_workers();
  void wait_for_work();
  void take_pieces();

  const std::function<void(std::uint32_t)>* work_ = nullptr;
  std::uint32_t count_ = 0;
  std::atomic<std::uint32_t> next_{0};
  std::atomic<std::uint32_t> round_{0};  ///< odd: the pool ends
  std::atomic<std::uint32_t> busy_{0};   ///< workers that have not finished this round
  std::vector<std::jthread> workers_;
};

/// What the ray caster draws into. Rows from the bottom up, as GL has them.
struct CastPicture {
  std::int32_t width = 0, height = 0;
  std::vector<std::uint32_t> rgba;  ///< as `CastPixels::rgba`; 0 if nothing is
  std::vector<float> depth;         ///< window depth; 1 if nothing is (blend: too little)

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
    /// Of blend, along the view axis, in the shortest voxel edge of all volumes.
    float step_vox = 1.0F;
    const CastKernels* kernels = cast_kernels()[0];
  };

  /// Throws VisualizerError.
  Caster(const SceneView& scene, std::span<const CastContent> contents, const Options& options);

  /// `density` is all of the volume.
  void update(std::size_t volume, std::span<const Density> density, const ChangedBricks& changed);

  /// Moves a volume; its voxels keep their edges.
  void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) {
    volumes_[volume].set_transform(world_from_voxel);
  }

  /// By which the surfaces of a volume are shaded.
  [[nodiscard]] const GradientRows& gradient(std::size_t volume) const {
    return volumes_[volume].gradient();
  }
  /// What each picture shows is in one of these boxes.
  [[nodiscard]] std::vector<BoxCorners> bodies() const;
  /// Other colours and opacities for all volumes, as in `TransferFunction`.
  void set_materials(const Palette& materials);

  /// Draws `parts` of the picture; the rest of it stays. Rays of blend end at `end_depth` (window
  /// depth, one per pixel of the picture) if it is given. `normals` (three floats per pixel, or
  /// none) are those of iso in eye space, for measurements.
  void draw(const View& view, std::span<const PixelRect> parts, CastPicture& picture,
            std::span<const float> end_depth = {}, std::span<float> normals = {});
  void draw(const View& view, const PixelRect& part, CastPicture& picture,
            std::span<const float> end_depth = {}, std::span<float> normals = {}) {
    draw(view, {&part, 1}, picture, end_depth, normals);
  }

 private:
  Options options_;
  std::vector<CastVolume> volumes_;
  std::vector<PixelRect> tiles_;  ///< pieces of work of one `draw`
  TilePool pool_;
};

}  // namespace kerf
