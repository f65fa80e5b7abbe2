// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/proxy/shell_probe.hpp"
#include "controller/scene/free_brick_map.hpp"
#include "controller/scene/shell_tool.hpp"
#include "controller/scene/surface_samples.hpp"
#include "controller/scene/tool_shapes.hpp"
#include "hil/lab/extremes/points.hpp"

namespace kerf::extremes {

inline constexpr Density kIso = 32768;
inline constexpr Density kFaintestDensity = kIso / 8;  ///< fainter ones are not felt

/// A volume whose voxels are units, with the first at the origin of contact space.
struct Body {
  VoxelGrid grid;
  std::vector<Density> density;
};

/// Share 0..1 of full density by place, clipped; the iso-surface is at 1/2.
template <class Share>
[[nodiscard]] Body body_of(VoxelGrid grid, Share&& share_at) {
  Body body{grid, {}};
  body.density.reserve(grid.voxel_count());
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        const double share = share_at(Point{double(x), double(y), double(z)});
        body.density.push_back(
            static_cast<Density>(std::lround(kDensityMax * std::clamp(share, 0.0, 1.0))));
      }
    }
  }
  return body;
}

/// From a signed distance, negative inside; density rises over two voxels.
template <class Distance>
[[nodiscard]] Body blurred(VoxelGrid grid, Distance&& distance) {
  return body_of(grid, [&](Point p) { return 0.5 - distance(p) / 2; });
}

/// A tool of voxels of 1 mm, so that mm are units.
[[nodiscard]] inline SceneTool tool_of_units(const char* shape, double radius, double length) {
  return make_tool(shape, shape, {.pitch_mm = 1, .radius_mm = radius, .length_mm = length});
}

/// One tool in one body, felt by the servo's own probe on the fastest kernels of this machine. The
/// body stays the caller's.
template <class N>
class ShellRig {
 public:
  ShellRig(const SceneTool& tool, const Body& body)
      : tool_(surface_samples(tool, 1.0), tool.round),
        shell_(tool_.shell()),
        map_(body.grid, body.density, kFaintestDensity),
        volume_(volume_of(body)),
        probe_(**kernel_sets(), shell_, std::span(&volume_, 1)) {
    probe_.turn({});
  }
  ShellRig(const ShellRig&) = delete;
  ShellRig& operator=(const ShellRig&) = delete;

  /// What a sweep asks.
  [[nodiscard]] ShellProbe<N>& field() { return probe_; }
  /// Half the sine of a turn that a sweep may make at once: see `turn_step_of`.
  [[nodiscard]] typename N::Unit turn_step() const {
    const double reach = std::max(1.0, static_cast<double>(shell_.reach));
    return typename N::Unit(shell_.table.round ? 0 : turn_step_of(reach));
  }

 private:
  [[nodiscard]] ShellVolume<N> volume_of(const Body& body) {
    memory_.hold(shell_);
    ShellVolume<N> volume;
    volume.field = {body.grid, body.density.data(), density_scale(kIso), map_.bricks()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      volume.frame.voxel_from_contact.row[axis][axis] = typename N::Ratio(1);
    }
    volume.places = memory_.places();
    return volume;
  }

  ShellTool<N> tool_;
  Shell<N> shell_;
  FreeBrickMap map_;
  ShellMemory<N> memory_;
  ShellVolume<N> volume_;
  ShellProbe<N> probe_;
};

}  // namespace kerf::extremes
