// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/gradient.hpp"
#include "lab/bench/kernel_bench.hpp"

namespace kerf {
namespace {

struct Taps {
  std::array<float, 125> x, y, z;
};

const Taps& farid_taps() {
  static const Taps kTable = [] {
    const GradientTaps tap = taps(GradientKernel::farid);
    const auto scale = static_cast<float>(std::ldexp(1.0, -tap.shift));
    Taps t;
    for (std::size_t i = 0; i < 125; ++i) {
      const std::size_t a = i % 5, b = i / 5 % 5, c = i / 25;
      t.x[i] = scale * static_cast<float>(tap.slope[a] * tap.smooth[b] * tap.smooth[c]);
      t.y[i] = scale * static_cast<float>(tap.smooth[a] * tap.slope[b] * tap.smooth[c]);
      t.z[i] = scale * static_cast<float>(tap.smooth[a] * tap.smooth[b] * tap.slope[c]);
    }
    return t;
  }();
  return kTable;
}

/// floor without a call: plain x86-64 has no instruction for it.
std::int32_t floor_of(float value) {
  const auto whole = static_cast<std::int32_t>(value);
  return static_cast<float>(whole) > value ? whole - 1 : whole;
}

/// Weights of a cell's corners; corner 4 k + 2 j + i is the voxel low + (i, j, k).
std::array<float, 8> weights_of(const std::array<float, 3>& t) {
  const float x = t[0], y = t[1], z = t[2];
  const float yz = y * z;
  const std::array<float, 4> edge{1 - y - z + yz, y - yz, z - yz, yz};
  return {edge[0] - x * edge[0], x * edge[0], edge[1] - x * edge[1], x * edge[1],
          edge[2] - x * edge[2], x * edge[2], edge[3] - x * edge[3], x * edge[3]};
}

}  // namespace

PaperVolume::PaperVolume(const VoxelGrid& grid, std::span<const Density> density)
    : grid_(grid), voxels_(grid.voxel_count()) {
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    voxels_[i].density = static_cast<float>(density[i] / kDensityMax);
  }
  refresh(grid.box());
}

void PaperVolume::refresh(const VoxelBox& box) {
  const Taps& tap = farid_taps();
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
        const VoxelBox reach =
            VoxelBox{{x - 2, y - 2, z - 2}, {x + 3, y + 3, z + 3}}.clipped(grid_.box());
        float gx = 0, gy = 0, gz = 0;
        for (std::int32_t k = reach.lo.z; k < reach.hi.z; ++k) {
          for (std::int32_t j = reach.lo.y; j < reach.hi.y; ++j) {
            const PaperVoxel* row = &voxels_[grid_.index(reach.lo.x, j, k)];
            const std::int32_t first = ((k - z + 2) * 5 + j - y + 2) * 5 + reach.lo.x - x + 2;
            auto i = static_cast<std::size_t>(first);
            for (std::int32_t n = reach.lo.x; n < reach.hi.x; ++n, ++row, ++i) {
              gx += tap.x[i] * row->density;
              gy += tap.y[i] * row->density;
              gz += tap.z[i] * row->density;
            }
          }
        }
        PaperVoxel& voxel = voxels_[grid_.index(x, y, z)];
        voxel.gx = gx;
        voxel.gy = gy;
        voxel.gz = gz;
      }
    }
  }
}

PaperVolume::Sample PaperVolume::sample_of(const ToolOffset& offset, const PaperPose& pose) {
  const std::array<float, 3> from_centre{0.5F * static_cast<float>(offset[0]),
                                         0.5F * static_cast<float>(offset[1]),
                                         0.5F * static_cast<float>(offset[2])};
  std::array<float, 3> at{};
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = pose.centre_vox[i] + pose.rotation[i][0] * from_centre[0] +
            pose.rotation[i][1] * from_centre[1] + pose.rotation[i][2] * from_centre[2];
  }
  const VoxelIndex low{floor_of(at[0]), floor_of(at[1]), floor_of(at[2])};
  return {low, weights_of({at[0] - static_cast<float>(low.x), at[1] - static_cast<float>(low.y),
                           at[2] - static_cast<float>(low.z)})};
}

PaperTick PaperVolume::feel(std::span<const ToolOffset> tool, const PaperPose& pose) const {
  PaperTick tick;
  float fx = 0, fy = 0, fz = 0;
  const auto row = static_cast<std::size_t>(grid_.nx);
  const std::size_t plane = row * static_cast<std::size_t>(grid_.ny);
  for (const ToolOffset& offset : tool) {
    const Sample sample = sample_of(offset, pose);
    const VoxelIndex low = sample.low;
    if (low.x < 0 || low.y < 0 || low.z < 0 || low.x > grid_.nx - 2 || low.y > grid_.ny - 2 ||
        low.z > grid_.nz - 2) {
      continue;
    }
    const PaperVoxel* corner = &voxels_[grid_.index(low.x, low.y, low.z)];
    for (std::size_t c = 0; c < 8; c += 2) {
      const PaperVoxel* edge = corner + ((c & 2) != 0 ? row : 0) + ((c & 4) != 0 ? plane : 0);
      const float near = sample.weight[c], far = sample.weight[c + 1];
      fx -= near * edge[0].gx + far * edge[1].gx;
      fy -= near * edge[0].gy + far * edge[1].gy;
      fz -= near * edge[0].gz + far * edge[1].gz;
    }
  }
  tick.contact = {fx, fy, fz};
  return tick;
}

PaperTick PaperVolume::mill(std::span<const ToolOffset> tool, const PaperPose& pose,
                            float k_times_t) {
  PaperTick tick = feel(tool, pose);
  VoxelBox touched;
  samples_.clear();
  for (const ToolOffset& offset : tool) {
    samples_.push_back(sample_of(offset, pose));
    const VoxelIndex low = samples_.back().low;
    touched = touched.united({low, {low.x + 2, low.y + 2, low.z + 2}});
  }
  const VoxelIndex size = touched.extent();
  const VoxelGrid local{size.x, size.y, size.z};
  overlap_.assign(local.voxel_count(), 0.0F);
  const auto row = static_cast<std::size_t>(local.nx);
  const std::size_t plane = row * static_cast<std::size_t>(local.ny);
  for (const Sample& sample : samples_) {
    float* corner = &overlap_[local.index(sample.low.x - touched.lo.x, sample.low.y - touched.lo.y,
                                          sample.low.z - touched.lo.z)];
    for (std::size_t c = 0; c < 8; ++c) {
      corner[(c & 1) + ((c & 2) != 0 ? row : 0) + ((c & 4) != 0 ? plane : 0)] += sample.weight[c];
    }
  }
  const VoxelBox box = touched.clipped(grid_.box());
  float fx = 0, fy = 0, fz = 0;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
        const float r = std::min(
            1.0F, overlap_[local.index(x - touched.lo.x, y - touched.lo.y, z - touched.lo.z)]);
        PaperVoxel& voxel = voxels_[grid_.index(x, y, z)];
        if (r == 0 || voxel.density == 0) continue;
        fx -= r * voxel.gx;
        fy -= r * voxel.gy;
        fz -= r * voxel.gz;
        const float loss = voxel.density * r * k_times_t;
        voxel.density -= loss;
        tick.removed += loss;
      }
    }
  }
  tick.modification = {fx, fy, fz};
  if (!box.empty()) refresh(box.grown(kGradientReach).clipped(grid_.box()));
  return tick;
}

}  // namespace kerf
