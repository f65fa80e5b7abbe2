// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/servo/coupling.hpp"
#include "controller/servo/proxy_contact.hpp"
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
  PointShell<N> point_shell;
  ProxyPlan<N> proxy;
};

/// What one tick hands to the next; the memory of `volumes` belongs to the compiled scene.
template <class N>
struct ContactState {
  std::array<ContactVolume<N>, kMaxVolumes> volumes{};  ///< by index of the plan's volumes
  ProxyState<N> proxy;
};

}  // namespace kerf
