// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace kerf {

/// Bytes that programs can still take before the system runs out, by the kernel's own estimate
/// (MemAvailable); nothing where it does not tell.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

}  // namespace kerf
