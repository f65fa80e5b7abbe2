// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>

/// Parameters of an arm, its motors and the hand that holds it, and the keys by which a user sets
/// them.
namespace kerf {

/// The behaviour of a device's motors when host packets stop.
enum class OnSilence : std::uint8_t { hold_torque, drop_torque };

inline constexpr int kMaxDelayCycles = 64;  // 8 ms

/// Parameters of every arm, and of the hand that holds it. Defaults are plausible ones for an Omni,
/// to be swept; none is a claim about a unit.
struct PlantParams {
  double tip_mass_kg = 0.045;         ///< apparent, of the Omni's data sheet
  double viscous_ns_per_mm = 0.0005;  ///< sweep 0..0.002
  double coulomb_n = 0.1;             ///< sweep 0..0.3; the sheet names 0.26 of back-drive friction

  /// Of each motor and its rotating parts, at the joint, on the encoder's side: all three, or 0 =
  /// part of the tip mass.
  std::array<double, 3> joint_inertia_kg_m2{};
  /// Structural mode: each inertia above on a spring, with this frequency while the link is held;
  /// 0 = rigid.
  double mode_hz = 0;
  double mode_damping_ratio = 0.02;

  std::array<double, 3> torque_nmm_per_count{0.342, 0.342, 0.342};  ///< 0.70 N m at full scale
  double current_lag_s = 0;     ///< time constant of the current loop; 0 = none
  int output_delay_cycles = 0;  ///< 0..kMaxDelayCycles, from a command to its torque
  int input_delay_cycles = 0;   ///< 0..kMaxDelayCycles, from the joints to their report
  OnSilence on_silence = OnSilence::hold_torque;
  int silence_cycles = 800;  ///< 100 ms without a command count as silence

  double hand_stiffness_n_per_mm = 0.5;
  double hand_damping_ns_per_mm = 0.005;
  double hand_mass_kg = 0.1;  ///< moves with the tip

  /// The natural frequency of the hand's spring with the hand and the tip on it.
  [[nodiscard]] double hand_rad_per_s() const noexcept {
    constexpr double kMmPerM = 1000;
    return std::sqrt(kMmPerM * hand_stiffness_n_per_mm / (hand_mass_kg + tip_mass_kg));
  }

  /// Torque of one motor count at each joint, N mm, without its sign: the host's setting for this
  /// unit (`torque_scale` of a scene, `--torque-scale`).
  [[nodiscard]] std::array<double, 3> torque_scale() const noexcept {
    const auto& t = torque_nmm_per_count;
    return {std::abs(t[0]), std::abs(t[1]), std::abs(t[2])};
  }
};

/// A parameter of device and hand that a user may set: in a hand script as `key` of the table
/// `[table]`, on the command line as `option`. Both ends of the range are allowed.
struct PlantKey {
  std::string_view table, key;
  const char* option;
  double low, high;
  bool whole;
  const char* meaning;
  void (*set)(PlantParams&, double);
};

template <double PlantParams::*kMember>
void set_plant(PlantParams& params, double value) {
  params.*kMember = value;
}
template <int PlantParams::*kMember>
void set_plant(PlantParams& params, double value) {
  params.*kMember = static_cast<int>(value);
}
inline void set_joint_inertia(PlantParams& params, double value) {
  params.joint_inertia_kg_m2.fill(value);
}

// A step of the mechanics has 31 us: a mode above 1 kHz is no longer resolved, and the stiffest
// hand on the lightest tip turns by a tenth of a radian in it.
inline constexpr PlantKey kPlantKeys[] = {
    {"device", "tip_mass_kg", "--tip-mass", 0.001, 10, false, "apparent mass of the tip, kg",
     set_plant<&PlantParams::tip_mass_kg>},
    {"device", "viscous_ns_per_mm", "--viscous", 0, 0.1, false,
     "viscous friction at the tip, N s/mm", set_plant<&PlantParams::viscous_ns_per_mm>},
    {"device", "coulomb_n", "--coulomb", 0, 10, false, "Coulomb friction at the tip, N",
     set_plant<&PlantParams::coulomb_n>},
    {"device", "joint_inertia_kg_m2", "--joint-inertia", 0, 0.1, false,
     "inertia of each motor at its joint, kg m^2 (default: part of the tip's mass)",
     set_joint_inertia},
    {"device", "mode_hz", "--mode-hz", 0, 1000, false,
     "structural mode of that inertia, Hz (default: rigid)", set_plant<&PlantParams::mode_hz>},
    {"device", "mode_damping_ratio", "--mode-damping", 0, 1, false, "its damping ratio",
     set_plant<&PlantParams::mode_damping_ratio>},
    {"device", "current_lag_s", "--current-lag", 0, 0.1, false,
     "time constant of the motors' current, s", set_plant<&PlantParams::current_lag_s>},
    {"device", "output_delay_cycles", "--output-delay", 0, kMaxDelayCycles, true,
     "bus cycles of 125 us from a command to its torque",
     set_plant<&PlantParams::output_delay_cycles>},
    {"device", "input_delay_cycles", "--input-delay", 0, kMaxDelayCycles, true,
     "bus cycles of 125 us from the encoders to their report",
     set_plant<&PlantParams::input_delay_cycles>},
    {"hand", "stiffness_n_per_mm", "--hand-stiffness", 0.001, 10, false,
     "stiffness of the grip, N/mm", set_plant<&PlantParams::hand_stiffness_n_per_mm>},
    {"hand", "damping_ns_per_mm", "--hand-damping", 0, 1, false, "damping of the grip, N s/mm",
     set_plant<&PlantParams::hand_damping_ns_per_mm>},
    {"hand", "mass_kg", "--hand-mass", 0, 10, false,
     "mass of the hand, which moves with the tip, kg", set_plant<&PlantParams::hand_mass_kg>},
};

/// The value given for each key; if none, the device's own is used.
using PlantValues = std::array<std::optional<double>, std::size(kPlantKeys)>;

inline void take_plant(const PlantValues& values, PlantParams& params) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i]) kPlantKeys[i].set(params, *values[i]);
  }
}

}  // namespace kerf
