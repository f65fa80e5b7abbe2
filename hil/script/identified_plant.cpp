// SPDX-License-Identifier: Apache-2.0
#include "hil/script/identified_plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <string_view>

#include "hil/device/packet_device.hpp"
#include "hil/hil_error.hpp"
#include "shared/text/text.hpp"

namespace kerf {

PlantValues plant_of(const IdentifiedDevice& device, double own_delay_s, const std::string& file) {
  PlantValues values;
  const auto set = [&](std::string_view key, const char* found, const char* unit, double value) {
    const auto* const row = std::ranges::find_if(
        kPlantKeys, [&](const PlantKey& one) { return one.table == "device" && one.key == key; });
    if (!(value >= row->low && value <= row->high)) {
      throw HilError(file + ": device." + found + ": " + number_text(value) + unit +
                     " are out of range for an emulated device; use " + number_text(row->low) +
                     " to " + number_text(row->high));
    }
    values[static_cast<std::size_t>(row - std::begin(kPlantKeys))] = value;
  };
  double mobility = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    IdentifiedDevice::Axes unit{};
    unit[axis] = 1;
    mobility += 1 / along(device, unit).mass_kg;
  }
  const auto mean = [](const IdentifiedDevice::Axes& axes) {
    return std::accumulate(axes.begin(), axes.end(), 0.0) / 3;
  };
  set("tip_mass_kg", "mass_kg", " kg", 3 / mobility);
  set("viscous_ns_per_mm", "viscous_ns_per_mm", " N s/mm", mean(device.viscous_ns_per_mm));
  set("coulomb_n", "coulomb_n", " N", mean(device.coulomb_n));
  const double beyond_s = std::max(0.0, device.delay_s - own_delay_s);
  set("output_delay_cycles", "delay_s", " bus cycles of 125 us",
      std::round(beyond_s * kCyclesPerSecond));
  return values;
}

}  // namespace kerf
