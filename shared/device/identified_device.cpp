// SPDX-License-Identifier: Apache-2.0
#include "shared/device/identified_device.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>

#include "shared/posix/input_file.hpp"
#include "shared/text/text.hpp"
#include "shared/text/toml.hpp"

namespace kerf {
namespace {

using Axes = IdentifiedDevice::Axes;
using Matrix = std::array<Axes, 3>;

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

/// One table of the file.
class FoundValues {
 public:
  struct Limits {
    double low, high;
  };

  FoundValues(const TomlNode& node, const std::string& file, std::string_view name)
      : node_(node), file_(file), name_(name) {
    if (node.form != TomlNode::Form::table) fail(node, ": not a table; write [device]");
  }

  [[noreturn]] void fail(const TomlNode& at, const std::string& what) const {
    throw DeviceFileError(
        one_line(file_ + ":" + std::to_string(at.line) + ": " + std::string(name_) + what));
  }

  void allow_only(std::initializer_list<std::string_view> keys) const {
    for (const TomlNode& entry : node_.entries) {
      if (std::ranges::find(keys, entry.key) != keys.end()) continue;
      fail(entry, "." + entry.key + ": unknown key; known here: " + listed(keys));
    }
  }

  [[nodiscard]] bool has(const char* key) const { return node_.find(key) != nullptr; }

  [[nodiscard]] double number(const char* key, Limits limits) const {
    return checked(found(key), key, limits);
  }

  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers(const char* key, Limits limits) const {
    const TomlNode& list = found(key);
    const std::string wanted = "; write " + std::to_string(N) + " numbers";
    if (list.form != TomlNode::Form::array)
      fail(list, "." + std::string(key) + ": not a list" + wanted);
    if (list.entries.size() != N) {
      fail(list,
           "." + std::string(key) + ": a list of " + std::to_string(list.entries.size()) + wanted);
    }
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) values[i] = checked(list.entries[i], key, limits);
    return values;
  }

  [[nodiscard]] const TomlNode& node() const { return node_; }

 private:
  /// An identification may have found less than a device needs.
  [[nodiscard]] const TomlNode& found(const char* key) const {
    const TomlNode* value = node_.find(key);
    if (value != nullptr) return *value;
    fail(node_, std::string(" has no ") + key +
                    ", which its identification did not find; identify the device again, all axes "
                    "moving");
  }

  [[nodiscard]] double checked(const TomlNode& value, const char* key, Limits limits) const {
    const auto number = value.number();
    if (!number) fail(value, "." + std::string(key) + ": not a number; write one");
    if (*number >= limits.low && *number <= limits.high) return *number;  // no nan is
    fail(value, "." + std::string(key) + " = " + value.shown + " is out of range; use " +
                    number_text(limits.low) + " to " + number_text(limits.high));
  }

  const TomlNode& node_;
  const std::string& file_;
  std::string_view name_;
};

constexpr double kMostViscous = 2, kMostCoulombN = 100, kMostDelayS = 1;

/// The ends of the intervals against which a loop is less stable.
void take_intervals(const TomlNode& file_node, const std::string& file, IdentifiedDevice& device) {
  device.least_viscous_ns_per_mm = device.viscous_ns_per_mm;
  device.least_coulomb_n = device.coulomb_n;
  device.most_delay_s = device.delay_s;
  const auto lower = [](const Axes& end, Axes& value) {
    // Friction is not negative, an end of its interval may be.
    for (std::size_t i = 0; i < 3; ++i) value[i] = std::clamp(end[i], 0.0, value[i]);
  };
  if (const TomlNode* node = file_node.find("low")) {
    const FoundValues low(*node, file, "low");
    if (low.has("viscous_ns_per_mm")) {
      lower(low.numbers<3>("viscous_ns_per_mm", {-kMostViscous, kMostViscous}),
            device.least_viscous_ns_per_mm);
    }
    if (low.has("coulomb_n")) {
      lower(low.numbers<3>("coulomb_n", {-kMostCoulombN, kMostCoulombN}), device.least_coulomb_n);
    }
  }
  if (const TomlNode* node = file_node.find("high")) {
    const FoundValues high(*node, file, "high");
    if (!high.has("delay_s")) return;
    device.most_delay_s = std::max(device.delay_s, high.number("delay_s", {0, kMostDelayS}));
  }
}

}  // namespace

IdentifiedDevice parse_identified_device(std::string_view text, const std::string& location) {
  TomlNode file;
  try {
    file = parse_toml(text);
  } catch (const TomlError& error) {
    throw DeviceFileError(
        one_line(location + ":" + std::to_string(error.line) + ": " + error.what()));
  }
  const TomlNode* found = file.find("device");
  if (found == nullptr) {
    throw DeviceFileError(one_line(location) +
                          ": no table [device]; give a file that kerf identify wrote");
  }
  const FoundValues table(*found, location, "device");
  table.allow_only({"mass_kg", "viscous_ns_per_mm", "coulomb_n", "weight_n", "quantum_mm",
                    "delay_s", "rate_hz", "mode_hz", "mode_damping_ratio"});
  constexpr double kMostKg = 100;
  const auto m = table.numbers<6>("mass_kg", {-kMostKg, kMostKg});
  IdentifiedDevice device;
  device.mass_kg = {{{m[0], m[3], m[4]}, {m[3], m[1], m[5]}, {m[4], m[5], m[2]}}};
  device.viscous_ns_per_mm = table.numbers<3>("viscous_ns_per_mm", {0, kMostViscous});
  device.coulomb_n = table.numbers<3>("coulomb_n", {0, kMostCoulombN});
  device.quantum_mm = table.numbers<3>("quantum_mm", {0, 10});
  device.delay_s = table.number("delay_s", {0, kMostDelayS});
  if (table.has("rate_hz")) device.rate_hz = table.number("rate_hz", {1, 1e6});
  if (!inverse_of_positive(device.mass_kg)) {
    table.fail(*table.node().find("mass_kg"),
               ".mass_kg: no mass, since it is not positive in each direction; write xx, yy, zz, "
               "xy, xz, yz as kerf identify does");
  }
  if (device.delay_s * device.rate_hz >= kMostIdentifiedPeriods) {
    table.fail(*table.node().find("delay_s"),
               format(".delay_s = %g is %.3g periods of %g Hz, and no device has 64; write seconds",
                      device.delay_s, device.delay_s * device.rate_hz, device.rate_hz));
  }
  take_intervals(file, location, device);
  return device;
}

IdentifiedDevice read_identified_device(const std::filesystem::path& file) {
  try {
    return parse_identified_device(read_input_file(file, "device.toml"), file.string());
  } catch (const InputFileError& error) {
    throw DeviceFileError(one_line(error.what()));
  }
}

DeviceDirection along(const IdentifiedDevice& device, Axes direction) {
  double length = 0;
  for (const double part : direction) length += part * part;
  for (double& part : direction) part /= std::sqrt(length);
  DeviceDirection out{.along = direction};
  const Matrix inverse = inverse_of_positive(device.mass_kg).value_or(Matrix{});
  double mobility = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double part = std::abs(direction[i]);
    for (std::size_t j = 0; j < 3; ++j) mobility += direction[i] * inverse[i][j] * direction[j];
    out.viscous_ns_per_mm += part * part * device.viscous_ns_per_mm[i];
    out.coulomb_n += part * device.coulomb_n[i];
    out.quantum_mm += part * device.quantum_mm[i];
    out.least_viscous_ns_per_mm += part * part * device.least_viscous_ns_per_mm[i];
    out.least_coulomb_n += part * device.least_coulomb_n[i];
  }
  out.mass_kg = 1 / mobility;
  return out;
}

}  // namespace kerf
