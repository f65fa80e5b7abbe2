// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "kerf/scene.hpp"
#include "kerf/tick.hpp"

namespace kerf {

/// The last tick of an arm, as a program with a force of its own sees it.
struct DeviceState {
  Tick tick = 0;                              ///< 0: none yet
  std::uint64_t answers = 0;                  ///< number of the newest force that came before it
  std::array<double, 3> position_mm{};        ///< tip in the scene; NaN until calibrated
  std::array<double, 4> orientation{};        ///< quaternion x, y, z, w; NaN until calibrated
  std::array<double, 3> velocity_mm_per_s{};  ///< at the device port; NaN until first in hand
  std::array<double, 3> force_n{};            ///< sent, after all limits
  Phase phase = Phase::off;
  Fault fault = Fault::none;
  std::uint32_t flags = 0;  ///< kFlag..., such as kFlagButton1
};

/// A haptic device for a force of your own, under kerf's limits: the page of memory that a
/// controller shares if its scene has `force.model = "external"` (docs/own-law.md; in C:
/// kerf/external.h). kerf arms the device, fades the force in, limits it, goes on with it while
/// this program is late, fades it out if the program is gone, and switches the motors off however
/// the run ends.
///
///     auto device = kerf::Device::open();
///     for (bool was_above = false; device.wait();) {          // the tip begins in its dock
///       const double y_mm = device.state().position_mm[1];
///       was_above = was_above || y_mm > 0;
///       device.give({.force_n = {0, was_above && y_mm < 0 ? -0.4 * y_mm : 0, 0}});
///     }
///
/// A stiff wall needs a goal with a stiffness, which the servo renders at its own rate; this loop
/// may be slow then, if `force.stale_ms` is two or three of its periods. One program at a time; one
/// thread.
class Device {
 public:
  /// That of the controller which runs under this name. Throws Error: there is none, its scene has
  /// another model, or another program gives the force.
  [[nodiscard]] static Device open(const std::string& name = "kerf");
  /// Gives the device back: the last force fades out.
  ~Device();
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;

  [[nodiscard]] std::size_t arms() const noexcept;
  [[nodiscard]] double period_s() const noexcept;
  /// mm of the scene for each mm of the device.
  [[nodiscard]] double workspace_scale() const noexcept;

  /// Waits for a new tick and copies it into `state`, for every arm. Returns false if the
  /// controller has ended; `state` keeps its last tick. Reads the page four times a period, as long
  /// as the controller lives.
  bool wait() noexcept;
  /// Copies the newest tick into `state`, and returns whether it is a new one. Does not wait,
  /// unless the controller was stopped while it wrote the page (kerf/external.h).
  bool poll() noexcept;
  /// False once `wait` or `poll` has found that the controller has ended.
  [[nodiscard]] bool alive() const noexcept;
  /// The tick that was copied last, at first the newest of `open`; zeros for an arm that the
  /// controller lacks.
  [[nodiscard]] const DeviceState& state(std::size_t arm = 0) const noexcept;

  /// What the arm gets from the next tick on; returns its number, which `answers` will reach, or 0
  /// for an arm that the controller lacks. What `ProgramForce` does not allow, the controller
  /// refuses and counts.
  std::uint64_t give(const ProgramForce& force, std::size_t arm = 0) noexcept;
  /// Forces that the controller refused up to this tick, of all arms.
  [[nodiscard]] std::uint64_t refused() const noexcept;

 private:
  struct Parts;
  explicit Device(std::unique_ptr<Parts> parts) noexcept;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kerf
