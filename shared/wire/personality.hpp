// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

// The kinds of devices, and what all of kerf knows of each: one row of kDeviceKinds. Whatever only
// one side knows of a kind stands in a row there: its kinematics and motors in the servo's numbers
// in controller/plan/plan_device.hpp, its emulation in hil/device/emulator.hpp, and so on
// (docs/architecture.md, "To add something").

namespace kerf {

/// Most devices of one scene; each is an arm with a tool of its own.
inline constexpr std::size_t kMaxArms = 2;

/// Kind of device. The first three are joint-count devices: kerf reads their encoders and drives
/// their motors. The others are Cartesian: the vendor's service or library reports a pose and takes
/// a force (shared/wire/cartesian.hpp). The values are those of the wire and of logs.
enum class Personality : std::uint8_t { omni, falcon, woodenhaptics, inverse3, touch, omega };

/// How the tip follows from the counts of a report.
enum class Kinematics : std::uint8_t {
  serial,  ///< turret, thigh and forearm
  delta,   ///< three legs
  axes     ///< x, y and z: a Cartesian device
};

/// Force limits of a device, the defaults of a scene. No scene may set a force above `peak_n`.
///
/// Sources: Omni, data sheet; Inverse3, product page; Touch, the vendor's configuration file;
/// omega.3, the continuous force of the product page. Falcon and WoodenHaptics can exert more (8.9
/// N and 5 N by their makers), but kerf has only been tested with the Omni's limits on them. The
/// slew rate is in proportion to the peak: 6.6 ms from zero to the peak.
struct ForceFigures {
  double peak_n = 3.3;
  double continuous_n = 0.88;  ///< RMS over time
  double slew_n_per_ms = 0.5;
};

namespace cartesian {

/// Figures of a Cartesian device.
///
/// Frame of all these devices: x right, y up, z to the user; mm. The code that calls a vendor's
/// service or library converts the vendor's axes.
struct Figures {
  int step_um;     ///< length of one count in the servo; 16-bit counts cover the workspace
  int quantum_um;  ///< resolution by the vendor
  bool has_wrist;  ///< reports an orientation
  /// Workspace of the data sheet, or a larger one, in the device's frame.
  std::array<double, 3> low_mm, high_mm;
  // Of the emulated one: where it is parked, and its mechanics at the tip.
  std::array<double, 3> rest_mm;
  double tip_mass_kg = 0.2, coulomb_n = 0.1;  ///< assumed
};

}  // namespace cartesian

/// What all of kerf knows of a kind of device.
struct DeviceKind {
  Personality personality;
  std::string_view word;  ///< in scenes, options, logs
  std::string_view port;  ///< of the controller: where `--port auto` looks for it
  Kinematics kinematics;
  ForceFigures forces = {};
  bool has_dock = true;           ///< is parked at one place only; else anywhere, by a button
  bool counts_from_dock = false;  ///< its encoders count from where it was parked; else absolute
  bool reports_homed = false;     ///< says itself whether its encoders are absolute yet
  bool has_pots = false;          ///< noisy potentiometers at the wrist
  /// Sends at its own rate, numbers its packets, and needs none of ours before. Else it answers
  /// transfers of the host, in frames of 1 ms.
  bool streams = false;
  bool needs_encoder_sign = false;  ///< builds differ in it: a scene must say which
  bool has_watchdog = false;        ///< switches its motors off when the host is silent
  bool has_service = false;         ///< a program of its vendor serves it over TCP
  std::optional<cartesian::Figures> axes = std::nullopt;  ///< of a Cartesian device
};

/// By Personality. Figures of the Cartesian ones:
///
///     Inverse3  510 x 460 x 230 mm, 10 um; origin at inverse3::kOriginM of the service's frame
///     Touch     55 um; the vendor's origin; in the inkwell all joint angles are 0; the mass of the
///               Omni, whose mechanics it has
///     omega.3   160 mm in diameter, 110 mm along z, 10 um; the vendor's origin
inline constexpr std::array kDeviceKinds{
    DeviceKind{.personality = Personality::omni,
               .word = "omni",
               .port = "fw",
               .kinematics = Kinematics::serial,
               .counts_from_dock = true,
               .has_pots = true,
               .streams = true},
    DeviceKind{.personality = Personality::falcon,
               .word = "falcon",
               .port = "usb",
               .kinematics = Kinematics::delta,
               .has_dock = false,
               .reports_homed = true},
    DeviceKind{.personality = Personality::woodenhaptics,
               .word = "woodenhaptics",
               .port = "hid",
               .kinematics = Kinematics::serial,
               .needs_encoder_sign = true,
               .has_watchdog = true},
    DeviceKind{.personality = Personality::inverse3,
               .word = "inverse3",
               .port = "arm",
               .kinematics = Kinematics::axes,
               .forces = {10, 4, 1.5},
               .has_dock = false,
               .reports_homed = true,
               .streams = true,
               .has_service = true,
               .axes = {{10, 10, true, {-230, -255, -115}, {230, 255, 115}, {0, 80, 0}}}},
    DeviceKind{.personality = Personality::touch,
               .word = "touch",
               .port = "arm",
               .kinematics = Kinematics::axes,
               .reports_homed = true,
               .streams = true,
               .axes = {{10, 55, true, {-200, -115, -95}, {200, 200, 95}, {0, -110, -35}, 0.045}}},
    DeviceKind{.personality = Personality::omega,
               .word = "omega",
               .port = "arm",
               .kinematics = Kinematics::axes,
               .forces = {12, 12, 1.8},
               .has_dock = false,
               .reports_homed = true,
               .streams = true,
               .axes = {{4, 10, false, {-80, -80, -55}, {80, 80, 55}, {0, 50, 0}}}}};

/// Whether `rows` has one row for each kind of device, in the order of the enum, so that a kind's
/// value is the index of its row. For a static_assert beside each such table.
template <class Rows>
[[nodiscard]] constexpr bool covers_devices(const Rows& rows) noexcept {
  if (rows.size() != kDeviceKinds.size()) return false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (static_cast<std::size_t>(rows[i].personality) != i) return false;
  }
  return true;
}
static_assert(covers_devices(kDeviceKinds));
static_assert(std::ranges::all_of(kDeviceKinds, [](const DeviceKind& kind) {
  return kind.axes.has_value() == (kind.kinematics == Kinematics::axes);
}));

/// The row of a kind in a table that covers_devices().
template <class Rows>
[[nodiscard]] constexpr const auto& row_of(const Rows& rows, Personality personality) noexcept {
  return rows[static_cast<std::size_t>(personality)];
}

[[nodiscard]] constexpr const DeviceKind& kind_of(Personality personality) noexcept {
  return row_of(kDeviceKinds, personality);
}

/// The words of all kinds, by Personality.
inline constexpr auto kPersonalityWords = [] {
  std::array<std::string_view, kDeviceKinds.size()> words;
  std::ranges::transform(kDeviceKinds, words.begin(), &DeviceKind::word);
  return words;
}();

[[nodiscard]] constexpr std::string_view word_of(Personality personality) noexcept {
  return kind_of(personality).word;
}

[[nodiscard]] constexpr bool is_cartesian(Personality personality) noexcept {
  return kind_of(personality).kinematics == Kinematics::axes;
}

[[nodiscard]] constexpr ForceFigures force_figures(Personality personality) noexcept {
  return kind_of(personality).forces;
}

/// The kind with this word; nullopt: none has it.
[[nodiscard]] constexpr std::optional<Personality> personality_of(std::string_view word) noexcept {
  for (const DeviceKind& kind : kDeviceKinds) {
    if (kind.word == word) return kind.personality;
  }
  return std::nullopt;
}

}  // namespace kerf
