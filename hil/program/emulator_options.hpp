// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "hil/device/plant_params.hpp"
#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/inverse3/service_device.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "shared/text/command_line.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// Options of the fronts that speak for a whole bus (fuse, usbip, uhid).
struct BusOptions {
  std::string mount;
  int packet_hz = 8000;
  double drift_ppm = 0;
  bool reset_stops_stream = false;
  bool firmware_runs = false;
  std::vector<std::string> faults;  ///< SECONDS:KIND
};

void declare_bus(Arguments& app, BusOptions& options);

/// Throws `HilError` for an impossible bus. `lockstep_hz`: servo rate in lock-step, 0 = real time.
[[nodiscard]] FirewireSettings firewire_settings(const BusOptions& options, int lockstep_hz);

/// Faults of the USB of Falcon and WoodenHaptics, which have no lock-step. Throws `HilError`.
[[nodiscard]] std::vector<ScriptedUsbFault> usb_script(const BusOptions& options);

/// Options of the front websocket: the emulated Inverse Service.
struct ServiceOptions {
  std::string where;       ///< [ADDRESS:]PORT
  std::string event_port;  ///< empty: no events
  std::string profile = "3.5-wireless";
};

void declare_service(Arguments& app, ServiceOptions& options);

/// Throws `HilError` for a fault that is none. `lockstep_hz`: servo rate in lock-step, 0 = real
/// time.
[[nodiscard]] ServiceSettings service_settings(const ServiceOptions& options,
                                               const std::vector<std::string>& faults,
                                               int lockstep_hz);

/// The command line of kerf-emulator.
struct EmulatorOptions {
  std::string device = "omni";  ///< a word of kPersonalityWords
  Personality personality{};    ///< of `device`, once checked
  bool describe = false;
  std::string front = "socket";
  std::string socket;
  std::string udp;
  BusOptions bus;
  ServiceOptions service;
  std::string hand;
  std::string hand_socket;
  std::string fault;
  std::string identified;
  std::optional<double> unit_mm;
  bool lockstep = false;
  int rate_hz = 1000;
  int packet_cycles = 4;
  int priority = 81;
  int cpu = -1;
  bool stay = false;
  double seconds = 0;
  double linger = 0;
  PlantValues plant;
  bool drop_torque = false;
  int silence_ms = 100;
  bool pot_noise = false;
  std::size_t packet_bytes = 14;
  bool wireless_button = false;
  std::uint32_t seed = 1;
  std::string report;
};

/// Declares all options. `app` then checks each value by itself only.
void declare(Arguments& app, EmulatorOptions& options);

/// Finds the personality. Throws `HilError` for options that do not fit together.
void check(EmulatorOptions& options);

/// The whole of kerf-emulator, for `main` and for tests: parses, serves, reports. Ends early when
/// `stop` becomes true (within 100 ms). Exit code 0 = fine, 2 = bad input or set-up (one line on
/// `err`).
int run_emulator(int argc, const char* const* argv, const std::atomic<bool>& stop,
                 std::ostream& out, std::ostream& err);

}  // namespace kerf
