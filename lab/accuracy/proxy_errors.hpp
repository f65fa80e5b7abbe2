// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "controller/kernel/kernel_set.hpp"
#include "controller/scene/scene.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/accuracy/contact_errors.hpp"
#include "lab/accuracy/subjects.hpp"
#include "lab/rig/contact_rig.hpp"
#include "lab/run/lab_run.hpp"

// Errors of the swept proxy, whose truth needs no integral: a hand that goes straight down from a
// contact leaves the tool there, and the spring from hand to tool is the way back.

namespace kerf::accuracy {

struct ProxyErrors {
  ErrorStats depth_vox;      ///< of the tool's centre along the normal, from where it should rest
  ErrorStats force;          ///< |F| over that of theory, less 1; if the spring is long enough
  ErrorStats direction_deg;  ///< between the force and the normal; if the spring is long enough
  ErrorStats step;           ///< |dF| per kStepMm along the face, over the force
};

/// A tool, and how far it reaches. mm are those of the subjects, in which its radius is kToolMm.
struct ProxyTool {
  SampledTool samples;
  std::function<double(Point normal)> support_mm;  ///< from its centre against a normal
};

/// Any tool, in subjects whose voxels are `voxel_mm` wide; `spacing`: of its samples, over the
/// servo's own. A ball reaches as far as its radius. Any other reaches as far as its samples, so
/// what they leave out is not seen.
[[nodiscard]] ProxyTool proxy_tool(const SceneTool& tool, double voxel_mm, double spacing = 1);

/// Presses the tool into each contact of a case, as deep as the contact says, and slides it along
/// the face from the first of them. A tool that finds no place counts as a proxy at the hand.
void add_proxy_errors(const ProxyTool& tool, NumericKind numeric, const KernelSet& kernels,
                      const ContactCase& at, int line_steps, ProxyErrors& errors);

/// Ticks along a loop about the first contact of a case.
[[nodiscard]] TickTimes time_proxy(const ProxyTool& tool, NumericKind numeric,
                                   const KernelSet& kernels, const ContactCase& at, int ticks);

}  // namespace kerf::accuracy
