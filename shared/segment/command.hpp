// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

// Commands of a reader to the controller, and the answers.

namespace kerf {

/// Default of `--name`: the name of a controller and its segment.
inline constexpr const char* kDefaultName = "kerf";

/// Kinds of commands.
enum class CommandKind : std::uint32_t {
  select_tool = 1,  ///< argument: index into the scene's tools; for one arm
  hold = 2,         ///< argument: 1 stops cutting and force, 0 goes on
  reset = 3,        ///< argument: 0; the volumes go back to their first content
  undo = 4,         ///< argument: 0; the volumes go back to their content before the last stroke
  redo = 5,         ///< argument: 0; the stroke that was undone last is cut again
  mark = 6,  ///< argument: 0; changes nothing: a place in the log, which a flight recorder keeps
};

/// One command: a message of fixed size over the socket, validated outside the servo, applied by
/// the servo at a tick boundary, logged as an input.
struct Command {
  CommandKind kind = CommandKind::hold;
  std::uint32_t index = 0;  ///< set by the server: 1, 2, ... in order of acceptance
  std::uint32_t argument = 0;
  std::uint32_t arm = 0;  ///< select_tool: 0 the first arm, 1 the second; else 0: for all arms
  double value[4] = {};   ///< for kinds that carry numbers; finite
  std::uint64_t reserved1[2] = {};
};
static_assert(sizeof(Command) == 64);

enum class ReplyStatus : std::uint32_t {
  accepted = 0,  ///< queued; applied within `kCommandSlots` ticks
  busy = 1,      ///< queue full: try again
  refused = 2,   ///< unknown kind, argument out of range or value not finite
};

/// The immediate answer of the server.
struct Reply {
  ReplyStatus status = ReplyStatus::refused;
  std::uint32_t index = 0;  ///< `Command::index`, as TickRecord::last_command will show it
};
static_assert(sizeof(Reply) == 8);

inline constexpr std::uint32_t kCommandSlots = 64;

/// Limits of the arguments, by the scene; checked before the queue.
struct CommandLimits {
  std::uint32_t tools = 1;
  std::uint32_t arms = 1;
};

/// Whether `command` may go to the servo.
[[nodiscard]] inline bool is_valid(const Command& command, const CommandLimits& limits) noexcept {
  if (!std::all_of(std::begin(command.value), std::end(command.value),
                   [](double v) { return std::isfinite(v); })) {
    return false;
  }
  switch (command.kind) {
    case CommandKind::select_tool:
      return command.argument < limits.tools && command.arm < limits.arms;
    case CommandKind::hold:
      return command.argument <= 1 && command.arm == 0;
    case CommandKind::reset:
    case CommandKind::undo:
    case CommandKind::redo:
    case CommandKind::mark:
      return command.argument == 0 && command.arm == 0;
  }
  return false;
}

}  // namespace kerf
