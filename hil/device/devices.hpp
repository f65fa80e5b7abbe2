// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>

#include "hil/device/device_model.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "shared/wire/personality.hpp"

/// Every emulated device by its personality.
namespace kerf {

/// Returns `use(params)`, given the parameters of this device as it is without options:
/// `OmniParams`, `FalconParams` or `WoodenParams`. `use` returns one type for all.
template <class Use>
[[nodiscard]] auto with_device_params(Personality personality, const Use& use) {
  switch (personality) {
    case Personality::falcon:
      return use(FalconParams{});
    case Personality::woodenhaptics:
      return use(WoodenParams{});
    case Personality::omni:
      break;
  }
  return use(OmniParams{});
}

[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const OmniParams& params) {
  return std::make_unique<OmniModel>(params);
}
[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const FalconParams& params) {
  return std::make_unique<FalconModel>(params);
}
[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const WoodenParams& params) {
  return std::make_unique<WoodenModel>(params);
}

/// N mm per motor count of the emulated unit: a scene's `device.torque_scale`.
[[nodiscard]] inline std::array<double, 3> torque_scale_of(Personality personality) {
  return with_device_params(personality, [](const auto& params) { return params.torque_scale(); });
}

}  // namespace kerf
