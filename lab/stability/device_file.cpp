// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/device_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <string_view>

#include "controller/stability/identified_loop.hpp"
#include "hil/hil_error.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

IdentifiedDevice read_device(const std::string& file) {
  try {
    return read_identified_device(file);
  } catch (const DeviceFileError& error) {
    throw HilError(error.what());
  }
}

}  // namespace

DeviceDirection direction_of(const IdentifiedDevice& device, const std::string& text,
                             double damping_ns_per_mm, double rate_hz) {
  constexpr std::string_view kAxes = "xyz";
  if (text.size() == 1 && kAxes.find(text[0]) != std::string_view::npos) {
    IdentifiedDevice::Axes axis{};
    axis[kAxes.find(text[0])] = 1;
    return along(device, axis);
  }
  if (text != "worst") {
    IdentifiedDevice::Axes given{};
    std::size_t begin = 0, count = 0;
    for (bool more = true; more; ++count) {
      const std::size_t comma = text.find(',', begin);
      const auto number = number_in(text.substr(begin, comma - begin));
      more = comma != std::string::npos;
      begin = comma + 1;
      if (!number || count >= given.size() || !(std::abs(*number) <= 1e6)) {
        count = 0;
        break;
      }
      given[count] = *number;
    }
    // Of the numbers that are taken the squares are, too: no part is lost, none is infinite.
    const bool is_none =
        std::ranges::all_of(given, [](double part) { return std::abs(part) < 1e-6; });
    if (count != given.size() || is_none) {
      throw HilError("--direction: " + text +
                     ": no direction of the device; give x, y, z, worst or such as 1,0,0.5");
    }
    return along(device, given);
  }
  return worst_direction(device, damping_ns_per_mm, rate_hz, LimitSettings().force_n);
}

DeviceDirection take_device(const std::string& file, const std::string& direction,
                            std::array<std::string, kAxisCount>& texts) {
  const IdentifiedDevice device = read_device(file);
  const auto number_of = [&](AxisId axis) {
    const std::string& text = texts[index_of(axis)];
    return number_in(text.empty() ? axis_kinds()[index_of(axis)].standard : text);
  };
  const auto rate_hz = number_of(AxisId::rate);
  if (!rate_hz || !(*rate_hz > 0)) {
    throw HilError("--rate: " + texts[index_of(AxisId::rate)] + ": the delay of " + file +
                   " is a time, so the map has one rate; give one");
  }
  const double periods = device.delay_s * *rate_hz;
  if (texts[index_of(AxisId::delay)].empty() && periods > kMaxDelayPeriods) {
    throw HilError(
        format("--rate: at %g Hz the delay of %s is %.4g periods, and a loop has up to "
               "%g; give a lower one",
               *rate_hz, file.c_str(), periods, kMaxDelayPeriods));
  }
  // The damping of a map is a range as a rule; the direction is then that at the standard one.
  const char* const standard = axis_kinds()[index_of(AxisId::damping)].standard;
  const auto damping = number_in(texts[index_of(AxisId::damping)]);
  const DeviceDirection found =
      direction_of(device, direction, damping.value_or(number_in(standard).value_or(0)), *rate_hz);
  const auto fill = [&](AxisId axis, double value) {
    std::string& text = texts[index_of(axis)];
    if (text.empty()) text = format("%.6g", value);
  };
  fill(AxisId::mass, found.mass_kg);
  fill(AxisId::viscous, found.viscous_ns_per_mm);
  fill(AxisId::friction, found.coulomb_n);
  fill(AxisId::quantum, found.quantum_mm);
  fill(AxisId::delay, periods);
  return found;
}

void take_device_option(const std::string& direction, bool arm,
                        std::array<std::string, kAxisCount>& texts, std::ostream& out) {
  std::string& device = texts[index_of(AxisId::device)];
  if (!device.ends_with(".toml")) {
    if (direction.empty() && device.find(".toml") == std::string::npos) return;
    if (direction.empty()) throw HilError("--device: " + device + ": give one file alone");
    throw HilError(
        "--direction: is that of a file behind --device; give such as --device "
        "device.toml, or leave it out");
  }
  if (device.find(',') != std::string::npos) {
    throw HilError("--device: " + device + ": give one file alone");
  }
  if (arm) {
    throw HilError("--device: " + device +
                   ": the whole arm is an emulated one; leave --arm out, or name its device");
  }
  const DeviceDirection found = take_device(device, direction.empty() ? "worst" : direction, texts);
  out << format("%s along %.3g, %.3g, %.3g: %.4g kg, %.4g N s/mm, friction %.4g N\n",
                device.c_str(), found.along[0], found.along[1], found.along[2], found.mass_kg,
                found.viscous_ns_per_mm, found.coulomb_n);
  device.clear();
}

}  // namespace kerf::zwidth
