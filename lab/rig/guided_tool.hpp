// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/proxy/proxy_sweep.hpp"
#include "lab/rig/contact_rig.hpp"

namespace kerf::extremes {

/// A tool in a body, guided open loop: the hand goes where it wants, whatever the force.
template <class N>
class GuidedTool {
 public:
  GuidedTool(const SampledTool& tool, const Body& body, Point start, double friction = 0,
             Density iso = kIso);

  /// The spring from the hand to the proxy: the force over the stiffness.
  Point tick(Point hand, const ToolTurn<N>& turn = {});

  /// Takes the proxy to a place that is free.
  void start(Point at) { pose_.centre = place_of<N>(at); }

  [[nodiscard]] Point proxy() const { return point_of<N>(pose_.centre); }
  [[nodiscard]] const ProxyPose<N>& pose() const { return pose_; }
  [[nodiscard]] const Swept<N>& swept() const { return swept_; }
  [[nodiscard]] std::int32_t most_queries() const { return most_queries_; }

 private:
  ContactRig<N> rig_;
  ProxyPose<N> pose_;
  SweepMemory<N> memory_;
  typename N::Unit friction_;
  Swept<N> swept_;
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

}  // namespace kerf::extremes
