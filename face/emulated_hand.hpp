// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>

#include "controller/load/loaded_scene.hpp"
#include "hil/device/device_model.hpp"
#include "hil/device/hand_script.hpp"
#include "shared/wire/personality.hpp"

// What `./kerf demo` hands from a scene to `kerf-emulator` and back. Both numbers go through texts
// there, so they are rounded here, too: the runs are equal to the bit.

namespace kerf {

/// `device.torque_scale` for the emulated device: the text of `kerf-emulator --describe`.
[[nodiscard]] std::array<double, 3> torque_scale_in_text(Personality personality);

/// `script` with a unit: its own, or the text of the scene's `hand_unit_mm`.
[[nodiscard]] HandScript with_unit(HandScript script, const LoadedScene& scene);

/// The device of the scene, as identified if it is, that the script is for. Throws HilError.
[[nodiscard]] std::unique_ptr<DeviceModel> model_for(const LoadedScene& scene,
                                                     const HandScript& script);

}  // namespace kerf
