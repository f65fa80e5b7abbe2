// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/scene/compile.hpp"
#include "controller/scene/scene.hpp"
#include "controller/shell/controller_options.hpp"

namespace kerf {

/// `--explain`: prints what the scene costs on this machine; it is not run. Throws
/// std::runtime_error with one line for a scene above the budget, after all is told.
void explain_scene(const ControllerOptions& options, Scene& scene, CompiledScene& servo);

}  // namespace kerf
