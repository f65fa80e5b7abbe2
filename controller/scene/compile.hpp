// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "controller/kernel/aligned_kernels.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/servo.hpp"

namespace kerf {

/// The scene compiler: turns a checked scene into plan and memory of the servo step, in the numbers
/// that the scene asks for.
///
/// Takes the volumes' densities and the tools' offsets over (they are empty in the scene
/// afterwards). A tool that the plan `aligned` can hold gets its tables; a solid volume gets a
/// gradient field if any other tool may touch it. Nothing is allocated after this. Throws
/// SceneError for a scene that the loop cannot hold: no solid volume, a voxel or a step outside the
/// number formats.
///
/// `kernels` run the plan `aligned`: the fastest of this machine unless a test asks for others.
[[nodiscard]] std::unique_ptr<Servo> compile(Scene& scene,
                                             const AlignedKernels& kernels = **aligned_kernels());

}  // namespace kerf
