// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>

// Commands from a reader to the controller, and the replies.

namespace kerf {

/// Default of `--name`: the name of a controller and its segment.
inline constexpr const char* kDefaultName = "kerf";

/// Kind of a command.
enum class CommandKind : std::uint32_t {
  select_tool = 1,  ///< argument: index of the tool in the scene; `arm` says for which arm
  hold = 2,         ///< argument: 1 stops cutting and force, 0 resumes
  reset = 3,        ///< argument: 0; restores the volumes of tick 0
  undo = 4,         ///< argument: 0; restores the volumes as they were before the last stroke
  redo = 5,         ///< argument: 0; repeats the stroke that was undone last
  mark = 6,  ///< argument: 0; marks the tick in the log; a flight recorder then saves its window
};

/// One command, a message of fixed size over the socket. It is validated outside the servo, applied
/// by the servo between two ticks, and logged as an input.
struct SegmentCommand {
  CommandKind kind = CommandKind::hold;
  std::uint32_t index = 0;  ///< set by the server: 1, 2, ... in order of acceptance
  std::uint32_t argument = 0;
  std::uint32_t arm = 0;  ///< select_tool: 0 the first, 1 the second; other kinds: 0, act on both
  std::uint64_t reserved[6] = {};  ///< 0
};
static_assert(sizeof(SegmentCommand) == 64);

enum class ReplyStatus : std::uint32_t {
  accepted = 0,  ///< queued; applied within `kCommandSlots` ticks
  busy = 1,      ///< queue full, an earlier command still open, or no controller: try again
  refused = 2,   ///< unknown kind, argument or reserved word out of range, or no right to command
};

/// The immediate reply of the server to a command.
struct Reply {
  ReplyStatus status = ReplyStatus::refused;
  std::uint32_t index = 0;  ///< of the command, for TickRecord::last_command; 0 if not accepted
};
static_assert(sizeof(Reply) == 8);

inline constexpr std::uint32_t kCommandSlots = 64;

/// Limits of the arguments in this scene; checked before a command is queued.
struct CommandLimits {
  std::uint32_t tools = 1;
  std::uint32_t arms = 1;
};

/// True if `command` may be queued for the servo.
[[nodiscard]] inline bool is_valid(const SegmentCommand& command,
                                   const CommandLimits& limits) noexcept {
  const auto is_zero = [](std::uint64_t word) { return word == 0; };
  if (!std::all_of(std::begin(command.reserved), std::end(command.reserved), is_zero)) return false;
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
