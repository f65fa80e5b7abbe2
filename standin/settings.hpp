// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "shared/wire/personality.hpp"

/// What a stand-in library is told: the environment variable KERF_STAND_IN, which
/// `./kerf stand-in` sets for the program that it starts (docs/stand-ins.md).
namespace kerf::standin {

inline constexpr const char* kVariable = "KERF_STAND_IN";

/// The members with a default of false or 0 from `drop_without_frame` on are switches for what no
/// document says about the vendor's library; both values are legitimate readings.
struct Settings {
  std::string socket;  ///< path of the socket that kerf-emulator serves
  Personality device = Personality::touch;
  bool lockstep = false;
  int rate_hz = 1000;  ///< of the servo thread (HD), of force commands (dhd)
  int priority = 0;    ///< HD, in real time: SCHED_FIFO of the servo thread, if it may; 0: none
  std::string ledger;  ///< file of the counts; empty: none is kept

  bool drop_without_frame = false;  ///< a tick without a frame ends the force; else it is held
  bool drop_on_stop = false;        ///< so does the end of the scheduler
  bool cut_excess = false;          ///< a force above the limit becomes 0; else it is clamped
  bool force_needs_enable = false;  ///< dhd: a force before dhdEnableForce is not applied
  bool uncalibrated = false;        ///< the device begins uncalibrated
  bool documented_handles = false;  ///< HD: no current device before init, by the documents
  bool hand_buttons = false;        ///< omega: button 0 is the hand's; else "parked"
  bool short_status = false;        ///< dhdGetStatus writes 16 words, as before SDK 3.16; else 17
  bool hand_waits = false;          ///< the hand begins with the first force, or after 2 s
  double ramp_s = 0;  ///< HD: the force rises within so long after a start; 0 = at once
  int stall_ms = 50;  ///< a callback (HD) or a pause with a force (dhd) above it stalls
};

/// Reads
/// `socket:PATH[,device=touch|omega][,lockstep][,rate=HZ][,priority=N][,ledger=PATH][,SWITCH]...`:
///
///     missed=hold|drop  stop=hold|drop  excess=clamp|cut  before-enable=apply|ignore
///     calibration=kept|lost  handles=seen|documented  button0=parked|hand  status=17|16
///     hand=enabled|pushed  ramp=SECONDS  stall=MS
///
/// Their words and ranges are known here alone; ./kerf stand-in asks for them. A path has no comma.
/// Throws std::invalid_argument with one line.
[[nodiscard]] Settings parse_settings(std::string_view text);

/// What is wrong with one SWITCH of the list, in one line after its name; empty: nothing. The rest
/// of the list is none.
[[nodiscard]] std::string refusal_of_switch(std::string_view word);

/// Those of the environment; throws likewise, also if the variable is not set.
[[nodiscard]] Settings settings_of_environment();

}  // namespace kerf::standin
