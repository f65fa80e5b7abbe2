// SPDX-License-Identifier: Apache-2.0
#include "face/emulated_hand.hpp"

#include <cstdio>
#include <cstdlib>

#include "controller/load/load_scene.hpp"
#include "hil/device/emulator.hpp"
#include "hil/script/identified_plant.hpp"

namespace kerf {
namespace {

double through_text(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return std::strtod(text, nullptr);
}

}  // namespace

std::array<double, 3> torque_scale_in_text(Personality personality) {
  std::array<double, 3> scale = torque_scale_of(personality);
  for (double& axis : scale) axis = through_text("%g", axis);  // as a C++ stream writes it
  return scale;
}

HandScript with_unit(HandScript script, const LoadedScene& scene) {
  if (!script.unit_mm) script.unit_mm = through_text("%.9g", hand_unit_mm(scene));
  return script;
}

std::unique_ptr<DeviceModel> model_for(const LoadedScene& scene, const HandScript& script) {
  PlantValues identified;
  if (scene.identified) {
    identified = plant_of(*scene.identified, 1.0 / scene.servo.rate_hz, scene.device.identified);
  }
  return with_device_params(scene.device.personality, [&](auto params) {
    take_plant(script.plant, params);
    take_plant(identified, params);
    return make_model(params);
  });
}

}  // namespace kerf
