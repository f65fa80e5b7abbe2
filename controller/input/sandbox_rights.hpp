// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <sys/types.h>

namespace kerf {

/// The files that a process in the sandbox begins with, beside /dev/null as its standard three.
inline constexpr int kSandboxChannel = 3, kSandboxMemory = 4;

/// For a fresh child process of `parent`, once: it ends with its parent; no signal of a terminal
/// ends it, and every other has its default; of the files that it inherited it keeps `channel` and
/// `memory`, by the numbers above. Throws std::runtime_error, one line, with `channel` still open.
void drop_inheritance(pid_t parent, int channel, int memory);

/// Gives up all rights but to read, to decode and to speak on kSandboxChannel: a filter of system
/// calls in which all others fail with EPERM, no new privileges, no core, no file of any size, so
/// much memory beyond what the process has now, so much CPU time (SIGXCPU then). Cannot be undone;
/// only another process can raise the limit of memory (`raise_memory`).
///
/// Throws std::runtime_error, one line.
void drop_rights(std::uint64_t memory_bytes, int cpu_s);

/// Lets the process `child`, which dropped its rights, take so many bytes more.
void raise_memory(pid_t child, std::uint64_t bytes) noexcept;

}  // namespace kerf
