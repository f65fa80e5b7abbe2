// SPDX-License-Identifier: Apache-2.0
#include "controller/stability/identified_loop.hpp"

#include <optional>

namespace kerf {

SampledLoop loop_along(const IdentifiedDevice& device, const DeviceDirection& direction,
                       double rate_hz, bool at_worst) {
  SampledLoop loop;
  loop.mass_kg = direction.mass_kg;
  loop.viscous_ns_per_mm =
      at_worst ? direction.least_viscous_ns_per_mm : direction.viscous_ns_per_mm;
  loop.period_s = 1 / rate_hz;
  loop.delay_s = at_worst ? device.most_delay_s : device.delay_s;
  loop.coulomb_n = at_worst ? direction.least_coulomb_n : direction.coulomb_n;
  loop.quantum_mm = direction.quantum_mm;
  return loop;
}

DeviceDirection worst_direction(const IdentifiedDevice& device, double damping_ns_per_mm,
                                double rate_hz) {
  // Half of the neighbours of a cube's middle: the others are the same lines.
  std::optional<DeviceDirection> worst;
  double lowest = 0;
  for (int code = 14; code < 27; ++code) {
    const DeviceDirection now =
        along(device, {double(code / 9 - 1), double(code / 3 % 3 - 1), double(code % 3 - 1)});
    const double boundary =
        highest_stiffness(loop_along(device, now, rate_hz, false), damping_ns_per_mm);
    if (worst && !(boundary < lowest)) continue;
    worst = now;
    lowest = boundary;
  }
  return *worst;
}

}  // namespace kerf
