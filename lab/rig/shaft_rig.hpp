// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "controller/kernel/proxy/tool_query.hpp"
#include "controller/tool/tool_shaft.hpp"
#include "lab/rig/contact_rig.hpp"

namespace kerf::extremes {

/// A tool of voxels of 1 mm with its shaft, so that mm are units.
[[nodiscard]] inline SceneTool tool_with(const char* shape, double radius, double length,
                                         const ShaftSize& shaft) {
  SceneTool tool = tool_of_units(shape, radius, length);
  tool.shaft = tool_shaft(shaft, length);
  return tool;
}

/// Such a tool among bodies, felt by the servo's own query. The caller keeps the bodies.
template <class N>
class ShaftRig {
 public:
  ShaftRig(const SceneTool& tool, const std::vector<const Body*>& bodies, Density iso = kIso) {
    const SampledTool head(tool);
    shells_.emplace_back(head.samples, head.round, head.close);
    head_ = shells_.back().point_shell();
    double reach = double(head_.reach);
    for (const ToolPart& part : parts_behind(tool)) {
      const PartSamples samples = part_samples(tool, part, 1);
      shells_.emplace_back(samples.samples, false, samples.close);
      behind_.part[behind_.count++] = {shells_.back().point_shell(),
                                       typename N::Real(part.middle_mm)};
      reach = std::max(reach, part.middle_mm + double(shells_.back().point_shell().reach));
    }
    turn_step_ = turn_step_of(reach);
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
  ProxyContact<N> tick(Point hand, const ToolTurn<N>& turn = {}) {
    field_->begin_tick();
    return follow({.turn_step = turn_step(), .ramp_per_tick = typename N::Real(1)}, state_,
                  {place_of<N>(hand), turn});
  }
  /// The last of so many ticks along a line.
  ProxyContact<N> lead(Point from, Point to, int ticks, const ToolTurn<N>& turn = {}) {
    ProxyContact<N> contact;
    for (int i = 1; i <= ticks; ++i) {
      contact = tick(from + (double(i) / ticks) * (to - from), turn);
    }
    return contact;
  }
  /// Half the sine of a turn that a sweep may make at once: see `turn_step_of`.
  [[nodiscard]] typename N::Unit turn_step() const { return typename N::Unit(turn_step_); }
  [[nodiscard]] ToolQuery<N>& field() { return *field_; }
  [[nodiscard]] Point proxy() const { return point_of<N>(state_.pose.centre); }
  [[nodiscard]] const ProxyState<N>& state() const { return state_; }

 private:
  std::deque<ToolPoints<N>> shells_;
  PointShell<N> head_;
  PartsBehind<N> behind_;
  std::deque<MappedField> fields_;
  std::deque<PlaceMemory<N>> places_;
  std::array<std::vector<ContactVolume<N>>, 1 + kMostBehind> volumes_;
  std::optional<ToolQuery<N>> field_;
  double turn_step_ = 0;
  ProxyState<N> state_;
};

}  // namespace kerf::extremes
