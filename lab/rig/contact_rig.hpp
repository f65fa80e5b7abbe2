// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/tool_points.hpp"
#include "controller/servo/proxy_contact.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/body.hpp"

namespace kerf::extremes {

inline constexpr Density kIso = 32768;

/// A tool of voxels of 1 mm, so that mm are units.
[[nodiscard]] inline SceneTool tool_of_units(const char* shape, double radius, double length) {
  return make_tool(shape, shape, {.pitch_mm = 1, .radius_mm = radius, .length_mm = length});
}

/// The samples of a tool in units: of a mesh they take some 0.4 seconds.
struct SampledTool {
  std::vector<Point> samples;
  std::vector<SurfaceSample> close;
  bool round = false;

  SampledTool(const SceneTool& tool)  // NOLINT(google-explicit-constructor): a tool is one
      : samples(surface_samples(tool, 1.0)), close(close_samples(tool, 1.0)), round(tool.round) {}
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

/// One tool among bodies, felt by the servo's own collision query: on the fastest kernels of this
/// machine unless said. The caller keeps the bodies.
template <class N>
class ContactRig {
 public:
  explicit ContactRig(const SampledTool& tool, const KernelSet& kernels = **kernel_sets());
  ContactRig(const SampledTool& tool, const Body& body, Density iso = kIso);
  ContactRig(const ContactRig&) = delete;
  ContactRig& operator=(const ContactRig&) = delete;

  void add(const Body& body, const ContactFrame<N>& frame, Density iso = kIso);
  /// One tick of the swept contact, as in the servo.
  ProxyContact<N> follow(const ProxyPlan<N>& plan, ProxyState<N>& state, const ProxyPose<N>& goal);

  /// What a sweep asks.
  [[nodiscard]] ContactQuery<N>& field() { return *query_; }
  [[nodiscard]] const ContactQuery<N>& field() const { return *query_; }
  /// Half the sine of a turn that a sweep may make at once: see `turn_step_of`.
  [[nodiscard]] typename N::Unit turn_step() const {
    const double reach = std::max(1.0, static_cast<double>(points_.reach));
    return typename N::Unit(points_.table.round ? 0 : turn_step_of(reach));
  }

 private:
  const KernelSet& kernels_;
  ToolPoints<N> tool_;
  PointShell<N> points_;
  std::deque<MappedField> fields_;
  std::deque<PlaceMemory<N>> memories_;
  std::vector<ContactVolume<N>> volumes_;
  std::optional<ContactQuery<N>> query_;
};

}  // namespace kerf::extremes
