// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/device_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "controller/stability/sampled_loop.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/script_table.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;
using Direction = std::array<double, 3>;

/// Of a symmetric matrix, by cofactors; empty if it is not positive definite (Sylvester).
std::optional<Matrix> inverse_of_positive(const Matrix& m) {
  const double minor = m[0][0] * m[1][1] - m[0][1] * m[1][0];
  Matrix cofactors{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      cofactors[j][i] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
    }
  }
  const double whole =
      m[0][0] * cofactors[0][0] + m[0][1] * cofactors[1][0] + m[0][2] * cofactors[2][0];
  if (!(m[0][0] > 0) || !(minor > 0) || !(whole > 0)) return std::nullopt;
  for (auto& row : cofactors) {
    for (double& value : row) value /= whole;
  }
  return cofactors;
}

/// Its identification may have found less than a map needs.
void require(const ScriptTable& table, const char* key) {
  if (table.has(key)) return;
  table.fail(std::string(" has no ") + key +
             ", which its identification did not find; identify the device again, all axes moving");
}

template <std::size_t N>
std::array<double, N> required(const ScriptTable& table, const char* key, ScriptRange range) {
  require(table, key);
  return table.numbers<N>(key, {}, range);
}

}  // namespace

IdentifiedDevice read_device(const std::string& file) {
  const TomlNode node = parse_script(read_script(file, "device.toml"), file);
  const ScriptTable top(node, file, "");
  const TomlNode* found = top.table("device");
  if (found == nullptr) {
    throw HilError(file + ": no table [device]; give a file that kerf identify wrote");
  }
  const ScriptTable table(*found, file, "device");
  table.allow_only({"mass_kg", "viscous_ns_per_mm", "coulomb_n", "weight_n", "quantum_mm",
                    "delay_s", "rate_hz", "mode_hz", "mode_damping_ratio", "mode_mass_ratio"});
  constexpr double kMostKg = 100;
  const auto m = required<6>(table, "mass_kg", {-kMostKg, kMostKg});
  IdentifiedDevice device;
  device.mass_kg = {{{m[0], m[3], m[4]}, {m[3], m[1], m[5]}, {m[4], m[5], m[2]}}};
  device.viscous_ns_per_mm = required<3>(table, "viscous_ns_per_mm", {0, 2});
  device.coulomb_n = required<3>(table, "coulomb_n", {0, 100});
  device.quantum_mm = required<3>(table, "quantum_mm", {0, 10});
  require(table, "delay_s");
  device.delay_s = table.number("delay_s", 0, {0, 1});
  if (!inverse_of_positive(device.mass_kg)) {
    table.fail(
        ".mass_kg: no mass, since it is not positive in each direction; write xx, yy, zz, xy, xz, "
        "yz "
        "as kerf identify does");
  }
  return device;
}

DeviceDirection along(const IdentifiedDevice& device, Direction direction) {
  double length = 0;
  for (const double part : direction) length += part * part;
  for (double& part : direction) part /= std::sqrt(length);
  DeviceDirection out{.along = direction};
  const Matrix inverse = inverse_of_positive(device.mass_kg).value_or(Matrix{});
  double mobility = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) mobility += direction[i] * inverse[i][j] * direction[j];
    out.viscous_ns_per_mm += direction[i] * direction[i] * device.viscous_ns_per_mm[i];
    out.coulomb_n += std::abs(direction[i]) * device.coulomb_n[i];
    out.quantum_mm += std::abs(direction[i]) * device.quantum_mm[i];
  }
  out.mass_kg = 1 / mobility;
  return out;
}

DeviceDirection direction_of(const IdentifiedDevice& device, const std::string& text,
                             double damping_ns_per_mm, double rate_hz) {
  constexpr std::string_view kAxes = "xyz";
  if (text.size() == 1 && kAxes.find(text[0]) != std::string_view::npos) {
    Direction axis{};
    axis[kAxes.find(text[0])] = 1;
    return along(device, axis);
  }
  if (text != "worst") {
    Direction given{};
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
    const bool is_none = std::ranges::all_of(given, [](double part) { return part == 0; });
    if (count != given.size() || is_none) {
      throw HilError("--direction: " + text +
                     ": no direction of the device; give x, y, z, worst or such as 1,0,0.5");
    }
    return along(device, given);
  }
  // Half of the neighbours of a cube's middle: the others are the same lines.
  std::optional<DeviceDirection> worst;
  double lowest = 0;
  for (int code = 14; code < 27; ++code) {
    const Direction line{double(code / 9 - 1), double(code / 3 % 3 - 1), double(code % 3 - 1)};
    const DeviceDirection now = along(device, line);
    SampledLoop loop;
    loop.mass_kg = now.mass_kg;
    loop.viscous_ns_per_mm = now.viscous_ns_per_mm;
    loop.period_s = 1 / rate_hz;
    loop.delay_s = device.delay_s;
    const double boundary = highest_stiffness(loop, damping_ns_per_mm);
    if (worst && !(boundary < lowest)) continue;
    worst = now;
    lowest = boundary;
  }
  return *worst;
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
  // The damping of a map is a range as a rule; the direction is that at the standard one.
  const double damping = number_in(axis_kinds()[index_of(AxisId::damping)].standard).value_or(0);
  const DeviceDirection found = direction_of(device, direction, damping, *rate_hz);
  const auto fill = [&](AxisId axis, double value) {
    std::string& text = texts[index_of(axis)];
    if (text.empty()) text = format("%.6g", value);
  };
  fill(AxisId::mass, found.mass_kg);
  fill(AxisId::viscous, found.viscous_ns_per_mm);
  fill(AxisId::friction, found.coulomb_n);
  fill(AxisId::quantum, found.quantum_mm);
  fill(AxisId::delay, device.delay_s * *rate_hz);
  return found;
}

}  // namespace kerf::zwidth
