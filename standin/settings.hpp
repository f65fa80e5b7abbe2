// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "shared/wire/personality.hpp"

/// What a stand-in library is told: the environment variable KERF_STAND_IN, which
/// `./kerf stand-in` sets for the program that it starts (docs/stand-ins.md).
namespace kerf::standin {

inline constexpr const char* kVariable = "KERF_STAND_IN";

/// Most devices of one program: DHD_MAX_DEVICE of earlier dhd headers, the only limit that a vendor
/// has published.
inline constexpr std::size_t kMostDevices = 4;

/// A vendor's library that is imitated.
struct LibraryKind {
  Personality personality;      ///< of the devices that it serves
  std::string_view first_name;  ///< of its first device, if the settings give none
  bool has_one_servo;           ///< one servo thread for all devices of a program
};
inline constexpr LibraryKind kHd{Personality::touch, "Default Device", true};
inline constexpr LibraryKind kDhd{Personality::omega, "omega.3", false};
inline constexpr std::array kLibraries{kHd, kDhd};

/// One emulated device.
struct DeviceSettings {
  std::string socket;  ///< path of the socket that its kerf-emulator serves
  Personality kind = kHd.personality;
  std::string name;    ///< HD: by which it is opened; none twice of a kind
  int rate_hz = 1000;  ///< of the servo thread (HD; one for all), of force commands (dhd)
  std::string ledger;  ///< file of its counts; empty: none is kept
};

/// What a second process gets that opens a device of HD: it was seen to be any of the three.
enum class InUse : std::uint8_t { timer, value, pose };

/// The members with a default of false or 0 from `drop_without_frame` on are switches for what no
/// document says about the vendor's library; both values are legitimate readings.
struct Settings {
  std::vector<DeviceSettings> devices;  ///< 1 to kMostDevices, in the order of their numbers
  std::string ledger;  ///< file of what belongs to no device: calls for unknown ones, the servo
                       ///< thread of HD; empty: none is kept
  bool lockstep = false;
  int priority = 0;  ///< HD, in real time: SCHED_FIFO of the servo thread, if it may; 0: none

  bool drop_without_frame = false;  ///< a tick without a frame ends the force; else it is held
  bool drop_on_stop = false;        ///< so does the end of the scheduler
  bool cut_excess = false;          ///< a force above the limit becomes 0; else it is clamped
  bool force_needs_enable = false;  ///< dhd: a force before dhdEnableForce is not applied
  bool uncalibrated = false;        ///< the device begins uncalibrated
  bool documented_handles = false;  ///< HD: no current device before init, by the documents
  bool hand_buttons = false;        ///< omega: button 0 is the hand's; else "parked"
  bool short_status = false;        ///< dhdGetStatus writes 16 words, as before SDK 3.16; else 17
  bool refuses_emulation = false;   ///< dhdEmulateButton without a gripper fails
  bool hand_waits = false;          ///< the hand begins with the first force, or after 2 s
  double ramp_s = 0;            ///< HD: the force rises within so long after a start; 0 = at once
  int stall_ms = 50;            ///< a callback (HD) or a pause with a force (dhd) above it stalls
  InUse in_use = InUse::timer;  ///< HD
};

/// Reads
/// `DEVICE[,DEVICE]...[,lockstep][,priority=N][,program=PATH][,SWITCH]...`, a device being
/// `socket:PATH[,device=touch|omega][,name=NAME][,rate=HZ][,ledger=PATH]`, and SWITCH
///
///     missed=hold|drop  stop=hold|drop  excess=clamp|cut  before-enable=apply|ignore
///     calibration=kept|lost  handles=seen|documented  button0=parked|hand  status=17|16
///     emulate-button=accept|refuse  hand=enabled|pushed  in-use=timer|value|pose  ramp=SECONDS
///     stall=MS
///
/// `program` is the ledger of no device; without it that of the first. A device without a name is
/// called as HD's default one, the second of its kind with a 2 behind it. The switches' words and
/// ranges are known here alone; ./kerf stand-in asks for them. Paths and names have no comma.
/// Throws std::invalid_argument with one line.
[[nodiscard]] Settings parse_settings(std::string_view text);

/// What is wrong with one SWITCH of the list, in one line after its name; empty: nothing. The rest
/// of the list is none.
[[nodiscard]] std::string refusal_of_switch(std::string_view word);

/// The settings in the environment. Throws std::invalid_argument, also if the variable is not set.
[[nodiscard]] Settings settings_of_environment();

}  // namespace kerf::standin
