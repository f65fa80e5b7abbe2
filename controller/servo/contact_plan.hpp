// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/tool_query.hpp"
#include "controller/law/coupling.hpp"
#include "controller/servo/proxy_contact.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/scene_limits.hpp"

namespace kerf {

/// Where contact space lies, and how the proxy's spring becomes a force; constant during a run.
template <class N>
struct ContactPlan {
  bool swept = false;                      ///< else the paper's sums are felt
  WorldVec<typename N::Real> origin_mm;    ///< of contact space
  typename N::Ratio units_per_mm{};        ///< of the world
  typename N::Ratio device_mm_per_unit{};  ///< unit over workspace scale
  typename N::Ratio mm_per_unit{};         ///< of the world
  Coupling<N> coupling;
};

/// A tool's surface and how its proxy moves.
template <class N>
struct SweptTool {
  PointShell<N> point_shell;  ///< of the head
  PartsBehind<N> behind;
  bool turned = false;  ///< by the stylus; else it keeps the world's axes, or is a ball alone
  ProxyPlan<N> proxy;
};

/// What one tick hands to the next; the memory of `volumes` belongs to the compiled scene.
template <class N>
struct ContactState {
  using Volumes = std::array<ContactVolume<N>, kMaxVolumes>;  ///< by index of the plan's volumes
  Volumes volumes{};
  std::array<Volumes, kMostBehind> behind{};  ///< the same with places of the parts behind the head
  ProxyState<N> proxy;
};

}  // namespace kerf
