// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace kerf {

/// A kind of fault. Names in fault files are those of `kFaultWords`.
enum class FaultKind : std::uint8_t {
  lose,        ///< packets vanish
  delay,       ///< packets come `ms` late
  duplicate,   ///< packets come twice
  reorder,     ///< a packet comes after its successor
  truncate,    ///< packets end early, at a random byte
  corrupt,     ///< one random bit of a packet is wrong
  stick,       ///< the encoder of `axis` stands still
  jump,        ///< the encoder is off by `counts`
  wander,      ///< the encoder is off by a random walk of steps up to `counts`
  park,        ///< the device reports that it is parked
  chatter,     ///< the device reports at random that it is parked
  unhome,      ///< the device reports that it is not homed (Falcon)
  noise,       ///< the low bits of the gimbal pots are noise (Omni)
  silence,     ///< the device sends nothing, and still receives
  unplug,      ///< the device neither sends nor receives
  host_late,   ///< the host stands still for `ms`
  replay,      ///< the packets of `ms` ago come again instead of new ones (Omni: they are numbered)
  freeze,      ///< every reading stands still (Falcon, WoodenHaptics)
  hang_up,     ///< the device ends the link for good, and still receives
  still,       ///< the position stands still while the gimbal turns (Cartesian)
  unreadable,  ///< no reply of the service can be read (Inverse3 by `--port ws`)
  closing,     ///< the service sends a closing frame (Inverse3 by `--port ws`)
  half_close,  ///< the service ends its side of the link, and reads on (Inverse3 by `--port ws`)
  both_closed,  ///< the service ends both sides of the link (Inverse3 by `--port ws`)
};

inline constexpr std::array<std::string_view, 24> kFaultWords{
    "lose",    "delay",   "duplicate",  "reorder",   "truncate",   "corrupt",
    "stick",   "jump",    "wander",     "park",      "chatter",    "unhome",
    "noise",   "silence", "unplug",     "host_late", "replay",     "freeze",
    "hang_up", "still",   "unreadable", "closing",   "half_close", "both_closed"};

/// A fault of the service and its link, which packets cannot show: ServiceLink plays it.
[[nodiscard]] constexpr bool is_of_service(FaultKind kind) noexcept {
  return kind >= FaultKind::unreadable;
}

/// The start of a script's clock; words in fault files are those of `kFaultClockWords`.
enum class FaultClock : std::uint8_t {
  push,   ///< the motors' first push (0.05 N at the tip)
  start,  ///< the emulator
};

inline constexpr std::array<std::string_view, 2> kFaultClockWords{"push", "start"};

/// The only fault that a controller latches in such a run if it keeps its safety contract; words in
/// fault files.
inline constexpr std::array<std::string_view, 6> kLatchWords{
    "none", "stale_input", "not_finite", "overspeed", "wrong_dock", "sparse_input"};

/// One fault, by the script's clock.
struct DeviceFault {
  FaultKind kind = FaultKind::lose;
  bool of_commands = false;  ///< of host packets; else of the device's (lose ... corrupt)
  double at_s = 0;
  double for_s = 0;  ///< 0: once
  int every = 1;     ///< each n-th packet
  int axis = 0;      ///< 0..2
  int counts = 0;
  double ms = 0;
};

struct FaultScript {
  std::vector<DeviceFault> faults;  ///< empty: all goes well
  std::uint32_t seed = 1;
  FaultClock clock = FaultClock::push;
  std::string latches{};  ///< of kLatchWords; empty: chance or the device decides
  double seconds = 4;     ///< that a lab plays it
  bool hides = false;     ///< one fault may keep another from changing anything: of `random_faults`
};

/// Reads a fault script, TOML of at most 1 MiB and 1000 faults.
///
///     seed = 1               # of everything random below
///     clock = "push"         # begins when the motors first push; or "start": with the emulator
///     latches = "none"       # demanded by kerf-lab faults: a word of kLatchWords; if missing,
///     nothing seconds = 4            # how long kerf-lab faults plays it
///     [[fault]]              # at least one, unless `seconds` gives the length of a run without
///     faults kind = "lose"          # a word of kFaultWords packets = "reports"    # or
///     "commands"; of lose, delay, duplicate, reorder, truncate,
///                            # corrupt
///     at_s = 0.5
///     for_s = 0.1            # none: once
///     every = 3              # each n-th packet, the first one included
///     axis = 0               # of stick, jump, wander: 0, 1 or 2
///     counts = 200           # of jump, wander
///     ms = 10                # of delay, host_late
///
/// Strict: an unknown key, a wrong type, a value out of range or a key that the kind does not have
/// throws `HilError` that names file and line. Start-up only.
[[nodiscard]] FaultScript read_fault_script(const std::filesystem::path& file);

/// Reads a fault script from text; `location` names it in errors.
[[nodiscard]] FaultScript parse_fault_script(std::string_view text, const std::string& location);

/// Three to six faults of any kind before `replay`, each of 20 to 320 ms (a late host: 1 to 100
/// ms), within two seconds, by `seed`.
[[nodiscard]] FaultScript random_faults(std::uint32_t seed);

}  // namespace kerf
