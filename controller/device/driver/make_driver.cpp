// SPDX-License-Identifier: Apache-2.0
#include "controller/device/driver/make_driver.hpp"

#include "controller/device/driver/falcon_driver.hpp"
#include "controller/device/driver/omni_driver.hpp"
#include "controller/device/driver/wooden_driver.hpp"

namespace kerf {

std::unique_ptr<DeviceDriver> make_driver(Personality personality, PacketPort& port) {
  switch (personality) {
    case Personality::falcon:
      return std::make_unique<FalconDriver>(port);
    case Personality::woodenhaptics:
      return std::make_unique<WoodenDriver>(port);
    case Personality::omni:
      break;
  }
  return std::make_unique<OmniDriver>(port);
}

}  // namespace kerf
