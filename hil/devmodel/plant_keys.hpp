// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string_view>

#include "hil/devmodel/plant_params.hpp"

namespace kerf {

/// One row of what a user may say of device and hand: in a hand script as `key` of the table
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
     "of each motor at its joint, kg m^2 (default: part of the tip's mass)", set_joint_inertia},
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
    {"hand", "stiffness_n_per_mm", "--hand-stiffness", 0.001, 10, false, "of the grip, N/mm",
     set_plant<&PlantParams::hand_stiffness_n_per_mm>},
    {"hand", "damping_ns_per_mm", "--hand-damping", 0, 1, false, "of the grip, N s/mm",
     set_plant<&PlantParams::hand_damping_ns_per_mm>},
    {"hand", "mass_kg", "--hand-mass", 0, 10, false, "of the hand, which moves with the tip, kg",
     set_plant<&PlantParams::hand_mass_kg>},
};

/// What was said of each row; nothing: the device's own.
using PlantValues = std::array<std::optional<double>, std::size(kPlantKeys)>;

inline void take_plant(const PlantValues& values, PlantParams& params) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i]) kPlantKeys[i].set(params, *values[i]);
  }
}

}  // namespace kerf
