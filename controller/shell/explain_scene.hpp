// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/shell/controller_options.hpp"

namespace kerf {

/// `--explain`: prints what the scene costs on this machine; it is not run. Throws
/// std::runtime_error with one line for a scene above the budget, after all is told.
void explain_scene(const ControllerOptions& options, LoadedScene& scene, CompiledScene& servo);

}  // namespace kerf
