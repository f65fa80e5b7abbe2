// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

// What a board supplies to the image. `board_mps2.cpp` has it for QEMU's mps2-an500; a port to
// another board writes these functions, a linker script, and, if its core is another one,
// start.cpp. Thread mode, after `kerf_start` has set up memory and the floating-point unit.

namespace kerf::bare {

/// Writes text that ends in 0. May block.
void write(const char* text) noexcept;

/// Ends the run. A board without a host waits here for its watchdog.
[[noreturn]] void finish(int code) noexcept;

/// Starts the counter behind `count`.
void start_count() noexcept;

/// A counter that runs down at a constant rate; 24 bits, wraps. Reads it alone, nothing blocks.
[[nodiscard]] std::uint32_t count() noexcept;

}  // namespace kerf::bare
