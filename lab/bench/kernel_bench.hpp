// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// One tick of one kind, by one way of computing it.
struct KernelRow {
  std::string name;     ///< contact/ball16/any
  std::string numeric;  ///< float (the paper) or fixed
  std::string isa;  ///< paper, reference (method `gather`, plain templates), scalar, avx2, avx512
  double p50_ns = 0, p99_ns = 0;
  double baseline_p50_ns = 0;  ///< in this run, the same tick: the paper's form if it has one
  std::size_t bytes = 0;       ///< memory of the tick beyond two bytes a voxel

  [[nodiscard]] double ratio() const noexcept { return baseline_p50_ns / p50_ns; }
};

/// Times the servo's kernels against the paper's form on 256 x 256 x 161 voxels, in this process on
/// this core. Calls `add_row` with each row when it is ready. Takes about a minute.
[[nodiscard]] std::vector<KernelRow> bench_kernels(
    const std::function<void(const KernelRow&)>& add_row);

/// Cost of the volume's memory layout for a tick of the 16-voxel ball: the copy of its box out of
/// a linear volume and out of bricks of 8^3 voxels, warm and with the caches swept before each tick
/// (the baseline is the linear copy), and contact and milling in volumes from 128 x 128 x 80 to
/// 512^3 (the baseline is the smallest).
[[nodiscard]] std::vector<KernelRow> bench_layout(
    const std::function<void(const KernelRow&)>& add_row);

/// Times one query of the swept contact, and one rotation of its tool, on 256 x 256 x 161 voxels,
/// in this process on this core. The paper has neither: ratios are relative to the plain loop's
/// time. Takes some seconds.
[[nodiscard]] std::vector<KernelRow> bench_queries(
    const std::function<void(const KernelRow&)>& add_row);

/// A voxel as the paper keeps it: 16 bytes.
struct PaperVoxel {
  float density;  ///< 0..1
  float gx, gy, gz;
};

/// Tool place in voxels, rotation row by row; pitch = voxel.
struct PaperPose {
  std::array<float, 3> centre_vox;
  std::array<std::array<float, 3>, 3> rotation;
};

struct PaperTick {
  std::array<float, 3> contact{}, modification{};
  float removed = 0;
};

/// The paper's method in its own form, which every benchmark quotes: an array of structures with
/// the gradient stored as float, samples interpolated one by one, and after a cut the gradient of
/// each touched voxel anew from its 5x5x5 neighbours.
///
/// Straightforward, not slowed down: each sample does its index arithmetic once, and the kernel's
/// 3 x 125 coefficients are a table.
class PaperVolume {
 public:
  PaperVolume(const VoxelGrid& grid, std::span<const Density> density);

  [[nodiscard]] PaperTick feel(std::span<const ToolOffset> tool, const PaperPose& pose) const;
  /// Contact and modification force, then removal of the fraction `k_times_t`, then the gradients.
  PaperTick mill(std::span<const ToolOffset> tool, const PaperPose& pose, float k_times_t);

 private:
  /// Low corner of a tool voxel's cell, and the weights of its corners.
  struct Sample {
    VoxelIndex low;
    std::array<float, 8> weight;
  };
  static Sample sample_of(const ToolOffset& offset, const PaperPose& pose);
  void refresh(const VoxelBox& box);

  VoxelGrid grid_;
  std::vector<PaperVoxel> voxels_;
  std::vector<Sample> samples_;  ///< of one tick, as is the next
  std::vector<float> overlap_;
};

}  // namespace kerf
