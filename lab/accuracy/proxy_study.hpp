// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "lab/accuracy/study.hpp"

namespace kerf::accuracy {

/// A tool and its voxels: of the standard, or of a scene.
struct ProxySubject {
  SceneTool tool;
  double voxel_mm;

  /// The ball of the study of the paper's force.
  [[nodiscard]] static ProxySubject standard();
};

/// Voxels, samples, numbers and kernels of the default contact, one changed at a time, on the six
/// shapes of the study, which grow with the tool; a tool that is no ball on the planes alone, since
/// the truth of the others is a ball's. Their knobs begin with "proxy". One that would have more
/// samples than a tick can read ("too many") has no figures.
[[nodiscard]] std::vector<Entry> proxy_study(
    const Scope& scope, const ProxySubject& subject,
    const std::function<void(double share, const std::string& what)>& progress);

}  // namespace kerf::accuracy
