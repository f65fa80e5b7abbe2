// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "controller/kernel/proxy/shell_probe.hpp"
#include "controller/scene/free_brick_map.hpp"
#include "controller/scene/shell_tool.hpp"
#include "controller/scene/surface_samples.hpp"
#include "controller/scene/tool_shapes.hpp"
#include "tests/kernel/support.hpp"
#include "tests/proxy/points.hpp"

/// Tools and bodies of known shape for the tests of the swept contact; all lengths in units.
namespace kerf::test {

/// Density from a signed distance, antialiased over `edge` voxels, the iso-surface at 1/2.
template <class Distance>
TestVolume body(VoxelGrid grid, double edge, Distance&& distance) {
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    const double share = 0.5 - distance(Point{double(x), double(y), double(z)}) / edge;
    return static_cast<Density>(std::lround(kDensityMax * std::clamp(share, 0.0, 1.0)));
  });
}

/// A tool of voxels of 1 mm, so that mm are units.
inline SceneTool tool_of_units(const char* shape, double radius, double length) {
  return make_tool("tool", shape, {.pitch_mm = 1, .radius_mm = radius, .length_mm = length});
}

template <class N>
ToolTurn<N> tool_turn(const std::array<Point, 3>& rotation) {
  TurnRows<N> rows;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) rows[i][j] = typename N::Unit(rotation[i][j]);
  }
  return turn_of<N>(rows);
}
inline constexpr std::array<Point, 3> kUpright{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

/// Rows of the rotation that takes the tool's y axis to `axis`.
inline std::array<Point, 3> turned_to(const Point& axis, Dice& dice) {
  const Point a = dice.across(axis), b = cross(a, axis);
  return {{{a[0], axis[0], b[0]}, {a[1], axis[1], b[1]}, {a[2], axis[2], b[2]}}};
}

/// A volume whose voxels are units, at the origin of contact space.
template <class N>
ContactFrame<N> plain_frame() {
  ContactFrame<N> frame;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.voxel_from_contact.row[axis][axis] = typename N::Ratio(1);
  }
  return frame;
}

/// One tool among volumes, with the memory to probe them.
template <class N>
class ShellRig {
 public:
  explicit ShellRig(const SceneTool& tool, const KernelSet& kernels = **kernel_sets())
      : kernels_(kernels), tool_(surface_samples(tool, 1.0), tool.round), shell_(tool_.shell()) {}
  ShellRig(const SceneTool& tool, const TestVolume& volume) : ShellRig(tool) {
    add(volume, plain_frame<N>());
  }
  ShellRig(const ShellRig&) = delete;
  ShellRig& operator=(const ShellRig&) = delete;

  /// `volume` stays the caller's.
  void add(const TestVolume& volume, const ContactFrame<N>& frame, Density iso = 32768) {
    maps_.emplace_back(volume.grid, volume.density, Density{1});
    memories_.emplace_back().hold(shell_);
    volumes_.push_back(
        {{volume.grid, volume.density.data(), density_scale(iso), maps_.back().bricks()},
         frame,
         memories_.back().places()});
    probe_.emplace(kernels_, shell_, volumes_);
    turn(kUpright);
  }

  /// What a sweep asks.
  [[nodiscard]] ShellProbe<N>& field() { return *probe_; }

  void turn(const std::array<Point, 3>& rotation) { probe_->turn(tool_turn<N>(rotation)); }
  [[nodiscard]] Probe<N> at(const Point& q) const { return probe_->probe(place_of<N>(q)); }
  [[nodiscard]] double free_distance(const Point& q) const {
    return double(probe_->free_distance(place_of<N>(q)));
  }

  /// How far beyond `q` along `n` the tool rests: its depth is 0 there. Within +-`range`.
  [[nodiscard]] double rest(const Point& q, const Point& n, double range = 1) const {
    double inner = -range, outer = range;
    for (int step = 0; step < 16; ++step) {
      const double middle = (inner + outer) / 2;
      (at(q + middle * n).depth > typename N::Real(0) ? inner : outer) = middle;
    }
    return (inner + outer) / 2;
  }

 private:
  const KernelSet& kernels_;
  ShellTool<N> tool_;
  Shell<N> shell_;
  std::deque<FreeBrickMap> maps_;
  std::deque<ShellMemory<N>> memories_;
  std::vector<ShellVolume<N>> volumes_;
  std::optional<ShellProbe<N>> probe_;
};

}  // namespace kerf::test
