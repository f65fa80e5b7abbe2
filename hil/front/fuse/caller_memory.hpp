// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <sys/types.h>

namespace kerf {

/// Memory of the process whose thread called, for pointers inside an ioctl's structure.
///
/// Needs the right to trace that process: the same user, or root. Any address may be asked for;
/// what is not mapped there ends the copy.

/// Copies from `address` on and returns how many bytes could be read.
[[nodiscard]] std::size_t read_caller(pid_t thread, std::uint64_t address,
                                      std::span<std::uint8_t> out) noexcept;

/// False when not all bytes could be written.
[[nodiscard]] bool write_caller(pid_t thread, std::uint64_t address,
                                std::span<const std::uint8_t> bytes) noexcept;

}  // namespace kerf
