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
#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/point_shell_table.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/contact_rig.hpp"
#include "tests/rig/geometry.hpp"

/// Tools among bodies under the servo's own swept contact, for studies and tests: a head, a head
/// with its shaft, a tool guided open loop, and a tool at rest.
namespace kerf::extremes {

inline constexpr Density kIso = kHalfDensity;

/// A tool of voxels of 1 mm, so that mm are units.
[[nodiscard]] inline SceneTool tool_of_units(const char* shape, double radius, double length) {
  return make_tool(shape, shape, {.pitch_mm = 1, .radius_mm = radius, .length_mm = length});
}

/// A tool in a body, guided open loop: the hand ignores the force.
template <class N>
class GuidedTool {
 public:
  GuidedTool(const SampledTool& tool, const Body& body, Point start, double friction = 0,
             Density iso = kIso);

  /// The spring from the hand to the proxy: the force over the stiffness.
  Point tick(Point hand, const Orientation<N>& orientation = {});

  /// Moves the proxy to a free position.
  void start(Point at) { pose_.centre = place_of<N>(at); }

  [[nodiscard]] Point proxy() const { return point_of<N>(pose_.centre); }
  [[nodiscard]] const ProxyPose<N>& pose() const { return pose_; }
  [[nodiscard]] const SweepResult<N>& swept() const { return swept_; }
  [[nodiscard]] std::int32_t most_queries() const { return most_queries_; }

 private:
  ContactRig<N> rig_;
  ProxyPose<N> pose_;
  SweepMemory<N> memory_;
  typename N::Unit friction_;
  SweepResult<N> swept_;
  std::int32_t most_queries_ = 0;
};

/// Largest step of a force from tick to tick over its mean.
class Roughness {
 public:
  void add(Point force) {
    if (count_ > 0) largest_ = std::max(largest_, length(force - last_));
    sum_ += length(force);
    last_ = force;
    ++count_;
  }
  [[nodiscard]] double ratio() const { return largest_ * count_ / sum_; }

 private:
  Point last_{};
  double largest_ = 0, sum_ = 0;
  int count_ = 0;
};

/// A tool of voxels of 1 mm with its shaft, so that mm are units.
[[nodiscard]] inline SceneTool tool_with(const char* shape, double radius, double length,
                                         const ShaftSize& shaft) {
  SceneTool tool = tool_of_units(shape, radius, length);
  tool.shaft = tool_shaft(shaft, length);
  return tool;
}

/// Such a tool among bodies under the servo's own query. The caller keeps the bodies.
template <class N>
class ShaftRig {
 public:
  ShaftRig(const SceneTool& tool, const std::vector<const Body*>& bodies, Density iso = kIso) {
    const SampledTool head(tool);
    shells_.emplace_back(head.samples, head.round, head.close, head.deficit);
    head_ = shells_.back().point_shell();
    double reach = double(head_.reach);
    for (const ToolPart& part : shaft_parts(tool)) {
      const PartSamples samples = part_samples(tool, part, 1);
      shells_.emplace_back(samples.samples, false, samples.close);
      behind_.part[behind_.count++] = {shells_.back().point_shell(),
                                       typename N::Real(part.middle_mm)};
      reach = std::max(reach, part.middle_mm + double(shells_.back().point_shell().reach));
    }
    rotation_step_ = rotation_step_of(reach);
    for (const Body* body : bodies) {
      fields_.emplace_back(body->grid, body->density, iso);
      for (std::size_t i = 0; i <= behind_.count; ++i) {
        places_.emplace_back().hold(i == 0 ? head_ : behind_.part[i - 1].point_shell);
        volumes_[i].push_back({fields_.back().field(), plain_frame<N>(), places_.back().places()});
      }
    }
    field_.emplace(**kernel_sets(), head_, volumes_[0], behind_,
                   std::array{std::span<const ContactVolume<N>>(volumes_[1]),
                              std::span<const ContactVolume<N>>(volumes_[2])});
  }

  ShaftRig(const ShaftRig&) = delete;
  ShaftRig& operator=(const ShaftRig&) = delete;

  /// One tick of the swept contact, as in the servo; the caller begins the field's tick.
  ProxyContact<N> follow(const ProxyPlan<N>& plan, ProxyState<N>& state, const ProxyPose<N>& goal) {
    return kerf::follow<N>(plan, state, *field_, goal);
  }
  ProxyContact<N> tick(Point hand, const Orientation<N>& orientation = {}) {
    field_->begin_tick();
    return follow({.rotation_step = rotation_step(), .ramp_per_tick = typename N::Real(1)}, state_,
                  {place_of<N>(hand), orientation});
  }
  /// The last of so many ticks along a line.
  ProxyContact<N> lead(Point from, Point to, int ticks, const Orientation<N>& orientation = {}) {
    ProxyContact<N> contact;
    for (int i = 1; i <= ticks; ++i) {
      contact = tick(from + (double(i) / ticks) * (to - from), orientation);
    }
    return contact;
  }
  /// Half the sine of a turn that a sweep may make at once: see `rotation_step_of`.
  [[nodiscard]] typename N::Unit rotation_step() const { return typename N::Unit(rotation_step_); }
  [[nodiscard]] ContactQuery<N>& field() { return *field_; }
  [[nodiscard]] Point proxy() const { return point_of<N>(state_.pose.centre); }
  [[nodiscard]] const ProxyState<N>& state() const { return state_; }

 private:
  std::deque<PointShellTable<N>> shells_;
  PointShell<N> head_;
  ShaftParts<N> behind_;
  std::deque<MappedField> fields_;
  std::deque<TransformedShell<N>> places_;
  std::array<std::vector<ContactVolume<N>>, 1 + kMaxShaftParts> volumes_;
  std::optional<ContactQuery<N>> field_;
  double rotation_step_ = 0;
  ProxyState<N> state_;
};

/// F9 of docs/contact.md: the rest position of a tool. In 20 ticks a hand presses it from `off`
/// units above `at`, along `up`, to one unit below.
template <class N>
[[nodiscard]] Point rest_of(const SampledTool& tool, const Body& body, Point at, Point up,
                            const Orientation<N>& orientation = {}, double off = 1.5,
                            Density iso = kIso) {
  GuidedTool<N> guided(tool, body, at + off * up, 0, iso);
  constexpr int kTicks = 20;
  for (int i = 0; i <= kTicks; ++i)
    guided.tick(at + (off - (off + 1) * i / kTicks) * up, orientation);
  return guided.proxy();
}

}  // namespace kerf::extremes
