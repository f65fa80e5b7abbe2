// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "controller/load/loaded_scene.hpp"
#include "controller/stability/limit_cycle.hpp"
#include "hil/device/device_model.hpp"
#include "hil/hil_error.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/tick_watch.hpp"

namespace kerf::zwidth {

/// Ways in which the whole arm meets walls.
inline constexpr std::size_t kArmHits = 6;
/// That of them whose push and speed may be any; the others push with what is given, or 0.5 N.
inline constexpr std::size_t kArmPress = 5;

/// A ball of 1 mm over a flat that meets two more walls in a corner, felt by the swept contact and
/// not cut, for the subject's device. Throws HilError for a rate that does not divide that of the
/// devices' mechanics.
[[nodiscard]] LoadedScene walls_scene(const LoopCase& subject);

/// That scene with this stiffness of the wall, by the subject's law.
[[nodiscard]] LoadedScene arm_scene(const LoadedScene& walls, const LoopCase& subject,
                                    double stiffness_n_per_mm);

/// The emulated device of the subject, with its hand: a spring of 0.2 N/mm if it has none.
[[nodiscard]] std::unique_ptr<DeviceModel> arm_model(const LoopCase& subject);

/// y of the tool's middle in that scene when it touches the flat, mm.
inline constexpr double kArmTouchMm = 1;

/// Nothing was measured: within 8 s the hand did not bring the device to the wall, by too much
/// friction, mass or damping.
class NotMet : public HilError {
 public:
  NotMet()
      : HilError(
            "the hand did not bring the device to the wall within 8 s; give less friction, mass or "
            "damping, or --hand firm") {}
};

/// The whole servo step, driver and emulated device in virtual time, on `walls_scene`. The hits,
/// each from a fresh start: the hand pushes slowly, hits the flat at 50 and 200 mm/s, slides onto
/// it at 50 mm/s, hits the corner of three walls at 50 mm/s, or meets the flat as `press` says;
/// then it stays. Only push and speed of a press count, and of the other hits its push. A hit is
/// judged
/// along the normal, in the corner along the diagonal, from its first contact on, by the device's
/// own encoders and the work of its motors. `watch` gets the device's true mechanics.
///
/// The subject's delay counts in whole bus cycles of 125 us; encoder and limits are those of
/// device and servo. Without a hand a spring of 0.2 N/mm pushes. Throws NotMet, or Interrupted.
[[nodiscard]] LimitCycle hit_with_arm(const LoadedScene& scene, const LoopCase& subject,
                                      double stiffness_n_per_mm, std::size_t hit,
                                      const Press& press, double limit_s, std::uint64_t seed,
                                      StepCounter& ticks, const SwingWatch& watch = {});

}  // namespace kerf::zwidth
