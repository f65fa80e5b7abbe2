// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/servo/device_report.hpp"
#include "controller/servo/servo_output.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// A compiled scene that can be stepped, whatever numbers it computes in.
///
/// `compile` makes one. `step`, `apply` and `penetration_mm` belong to the servo thread and are the
/// functions of servo_step.hpp; the rest is constant, or to be read while no step runs.
class Servo {
 public:
  virtual ~Servo() = default;

  [[nodiscard]] virtual ServoOutput step(const DeviceReport& report) noexcept = 0;
  virtual bool apply(const ServoCommand& command) noexcept = 0;
  [[nodiscard]] virtual double penetration_mm() const noexcept = 0;

  [[nodiscard]] virtual VoxelGrid grid(std::size_t scene_index) const noexcept = 0;

  /// Density of volume `scene_index`, x fastest; solid volumes change as they are cut.
  [[nodiscard]] virtual std::span<const Density> density(
      std::size_t scene_index) const noexcept = 0;
};

}  // namespace kerf
