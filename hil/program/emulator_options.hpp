// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "hil/program/bus_options.hpp"
#include "shared/text/command_line.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// The command line of kerf-emulator.
struct EmulatorOptions {
  std::string device = "omni";  ///< a word of kPersonalityWords
  Personality personality{};    ///< the same, once checked
  bool describe = false;
  std::string front = "socket";
  std::string socket;
  std::string udp;
  BusOptions bus;
  std::string hand;
  std::string fault;
  std::optional<double> unit_mm;
  bool lockstep = false;
  int rate_hz = 1000;
  int packet_cycles = 4;
  int priority = 81;
  int cpu = -1;
  bool stay = false;
  double seconds = 0;
  double joint_inertia_kg_m2 = 0;
  double mode_hz = 0;
  bool drop_torque = false;
  bool pot_noise = false;
  std::size_t packet_bytes = 14;
  bool wireless_button = false;
  std::uint32_t seed = 1;
  std::string report;
};

/// Tells `app` about all options. What `options` holds then is checked one by one only.
void declare(Arguments& app, EmulatorOptions& options);

/// Finds the personality. Throws `HilError` for options that do not fit together.
void check(EmulatorOptions& options);

}  // namespace kerf
