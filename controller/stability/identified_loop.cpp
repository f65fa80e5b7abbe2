// SPDX-License-Identifier: Apache-2.0
#include "controller/stability/identified_loop.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>
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

double pushed_stiffness(const SampledLoop& loop, double damping_ns_per_mm, double peak_n) {
  constexpr double kMmPerM = 1000;
  const double late_s = loop.period_s / 2 + loop.delay_s;
  const double swing =
      8 / std::numbers::pi * (loop.coulomb_n / peak_n) * std::sqrt(loop.mass_kg / kMmPerM) / late_s;
  const double root =
      (swing + std::sqrt(swing * swing + 4 * highest_stiffness(loop, damping_ns_per_mm))) / 2;
  return root * root;
}

DeviceDirection worst_direction(const IdentifiedDevice& device, double damping_ns_per_mm,
                                double rate_hz, double peak_n) {
  // Half of the neighbours of a cube's middle: the others are the same lines.
  std::optional<DeviceDirection> worst;
  double lowest = 0;
  const auto try_along = [&](const IdentifiedDevice::Axes& direction) {
    const DeviceDirection now = along(device, direction);
    const double boundary =
        pushed_stiffness(loop_along(device, now, rate_hz, false), damping_ns_per_mm, peak_n);
    if (worst && !(boundary < lowest)) return false;
    worst = now;
    lowest = boundary;
    return true;
  };
  for (int code = 14; code < 27; ++code) {
    const int x = code / 9 - 1, y = code / 3 % 3 - 1, z = code % 3 - 1;
    try_along({double(x), double(y), double(z)});
  }
  // Two of them are at most 45 degrees apart. A step along x, y or z is one on the sphere, too; the
  // one along the direction itself leads nowhere.
  constexpr double kFirstRad = 0.4, kLastRad = 0.001;
  for (double step = kFirstRad; step > kLastRad; step /= 2) {
    bool better = true;
    constexpr int kMostSteps = 8;  // further than to the next of the 13
    for (int steps = 0; better && steps < kMostSteps; ++steps) {
      better = false;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const double side : {-step, step}) {
          IdentifiedDevice::Axes direction = worst->along;
          direction[axis] += side;
          better = try_along(direction) || better;
        }
      }
    }
  }
  return *worst;
}

}  // namespace kerf
