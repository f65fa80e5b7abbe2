// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/proxy.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/point_shell_table.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"

// A tool among volumes under the servo's own swept contact, without a scene, a device or limits:
// for studies and tests. Lengths in units of contact space.

namespace kerf {

/// The density at the surface, if a volume has no other.
inline constexpr Density kHalfDensity = 32768;

/// The samples of a tool in units: of a mesh they take some 0.4 seconds.
struct SampledTool {
  std::vector<std::array<double, 3>> samples;
  std::vector<SurfaceSample> close;
  double deficit = 0;
  bool round = false;

  /// `unit_mm`: the edge of the finest voxel. `spacing`: of the samples, over the servo's own.
  SampledTool(const SceneTool& tool,  // NOLINT(google-explicit-constructor): a tool is one
              double unit_mm = 1, double spacing = 1)
      : samples(surface_samples(tool, unit_mm * spacing)),
        close(close_samples(tool, unit_mm)),
        deficit(support_deficit_mm(tool.mesh, close) / unit_mm),
        round(tool.round) {
    const auto to_units = [unit_mm](std::array<double, 3>& at) {
      for (double& mm : at) mm /= unit_mm;
    };
    for (auto& sample : samples) to_units(sample);
    for (SurfaceSample& sample : close) to_units(sample.at);
  }
};

/// A volume whose voxels are units, at the origin of contact space.
template <class N>
[[nodiscard]] ContactFrame<N> plain_frame() {
  ContactFrame<N> frame;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.voxel_from_contact.row[axis][axis] = typename N::Ratio(1);
  }
  return frame;
}

/// One tool among volumes under the servo's own collision query, by default on the fastest kernels
/// of this machine. A volume has a `grid` and a `density`, which the caller keeps. In FixedNumbers
/// and DoubleNumbers.
template <class N>
class ContactRig {
 public:
  explicit ContactRig(const SampledTool& tool, const KernelSet& kernels = **kernel_sets());
  template <class Volume>
  ContactRig(const SampledTool& tool, const Volume& volume, Density iso = kHalfDensity)
      : ContactRig(tool) {
    add(volume, plain_frame<N>(), iso);
  }
  ContactRig(const ContactRig&) = delete;
  ContactRig& operator=(const ContactRig&) = delete;

  template <class Volume>
  void add(const Volume& volume, const ContactFrame<N>& frame, Density iso = kHalfDensity) {
    add(volume.grid, volume.density, frame, iso);
  }
  /// One tick of the swept contact, as in the servo.
  ProxyContact<N> follow(const ProxyPlan<N>& plan, ProxyState<N>& state, const ProxyPose<N>& goal);

  /// The query of a sweep.
  [[nodiscard]] ContactQuery<N>& field() { return *query_; }
  /// Half the sine of a turn that a sweep may make at once: see `rotation_step_of`.
  [[nodiscard]] typename N::Unit rotation_step() const {
    const double reach = std::max(1.0, static_cast<double>(points_.reach));
    return typename N::Unit(points_.table.round ? 0 : rotation_step_of(reach));
  }

 private:
  void add(const VoxelGrid& grid, std::span<const Density> density, const ContactFrame<N>& frame,
           Density iso);

  const KernelSet& kernels_;
  PointShellTable<N> tool_;
  PointShell<N> points_;
  std::deque<MappedField> fields_;
  std::deque<TransformedShell<N>> memories_;
  std::vector<ContactVolume<N>> volumes_;
  std::optional<ContactQuery<N>> query_;
};

}  // namespace kerf
