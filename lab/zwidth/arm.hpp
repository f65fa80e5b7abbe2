// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/load/loaded_scene.hpp"
#include "lab/zwidth/subject.hpp"
#include "lab/zwidth/swing.hpp"

namespace kerf::zwidth {

/// A ball of 1 mm over a flat, felt by the swept contact and not cut, for the subject's device.
/// Throws HilError for a rate that does not divide that of the devices' mechanics.
[[nodiscard]] LoadedScene flat_scene(const Subject& subject);

/// The whole servo step, driver and emulated device in virtual time, on `flat_scene`: the hand
/// pushes slowly, then hits at 50 and 200 mm/s, and stays for `seconds` each time. A hit is judged
/// from its first contact on, by the device's own encoders and the servo's own account of its work;
/// the first that is bad by both rules ends the run.
///
/// The subject's delay counts in whole bus cycles of 125 us; its encoder, estimator, law and limits
/// are those of device and servo. Without a hand a spring of 0.05 N/mm pushes. Counts its ticks in
/// `ticks`. Throws HilError where the device never gets to the wall.
[[nodiscard]] Swing hit_with_arm(const LoadedScene& scene, const Subject& subject,
                                 double stiffness_n_per_mm, double seconds, std::uint64_t seed,
                                 std::uint64_t& ticks);

}  // namespace kerf::zwidth
