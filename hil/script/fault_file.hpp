// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "hil/script/fault_script.hpp"

namespace kerf {

/// Reads a fault script, TOML of at most 1 MiB and 1000 faults.
///
///     seed = 1               # of everything random below
///     clock = "push"         # begins when the motors first push; or "start": with the emulator
///     latches = "none"       # what kerf-lab faults demands: a word of kLatchWords; none: nothing
///     [[fault]]
///     kind = "lose"          # a word of kFaultWords
///     packets = "reports"    # or "commands"; of lose, delay, duplicate, reorder, truncate,
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

/// The same from text; `place` names it in errors.
[[nodiscard]] FaultScript parse_fault_script(std::string_view text, const std::string& place);

/// Three to six faults of any kind within four seconds, by `seed`.
[[nodiscard]] FaultScript random_faults(std::uint32_t seed);

}  // namespace kerf
