// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <string>
#include <vector>

#include "shared/segment/writer.hpp"

namespace kerf::test {

/// A volume of noise, so that no two bricks are alike.
struct NoiseVolume {
  explicit NoiseVolume(VoxelGrid g, std::uint32_t seed = 1) : grid(g), density(g.voxel_count()) {
    std::mt19937 random(seed);
    for (Density& d : density) d = static_cast<Density>(random());
  }
  [[nodiscard]] SegmentVolumeSpec spec() const {
    SegmentVolumeSpec out;
    out.grid = grid;
    out.density = density;
    out.labels = labels;
    return out;
  }
  /// Takes one from every voxel of `box`: each call changes each of them.
  void cut(const VoxelBox& box) {
    const VoxelBox in = box.clipped(grid.box());
    for (std::int32_t z = in.lo.z; z < in.hi.z; ++z) {
      for (std::int32_t y = in.lo.y; y < in.hi.y; ++y) {
        for (std::int32_t x = in.lo.x; x < in.hi.x; ++x) --density[grid.index(x, y, z)];
      }
    }
  }
  void fill(Density value) { density.assign(density.size(), value); }

  VoxelGrid grid;
  std::vector<Density> density;
  std::vector<Label> labels;
};

[[nodiscard]] inline SegmentSpec spec_of(const NoiseVolume& volume) {
  SegmentSpec spec;
  spec.volumes = {volume.spec()};
  spec.scene_json = R"({"tools":[]})";
  spec.config_hash = 0x1234;
  spec.build_id = "test";
  return spec;
}

/// One whole tick: cuts `box`, publishes it and a record that carries the tick; the second arm's
/// has the opposite position.
inline void cut_and_publish(SegmentWriter& writer, NoiseVolume& volume, Tick tick,
                            const VoxelBox& box, std::size_t arms = 1) {
  volume.cut(box);
  writer.begin_tick(tick);
  writer.publish_box(0, volume.density, box, 1);
  TickRecord record{};
  record.tick = tick;
  record.position_mm[0] = static_cast<double>(tick);
  if (arms == 2) {
    TickRecord second = record;
    second.position_mm[0] = -record.position_mm[0];
    writer.publish_state(second, 1);
  }
  writer.publish_state(record);
  writer.end_tick(tick * 1'000'000);
}

/// A cube of `edge` voxels somewhere inside `grid`, clipped.
template <class Random>
[[nodiscard]] VoxelBox random_box(Random& random, const VoxelGrid& grid, std::int32_t edge) {
  const auto below = [&random](std::int32_t n) {
    return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(n));
  };
  const VoxelIndex lo{below(grid.nx), below(grid.ny), below(grid.nz)};
  return VoxelBox{lo, {lo.x + edge, lo.y + edge, lo.z + edge}}.clipped(grid.box());
}

}  // namespace kerf::test
