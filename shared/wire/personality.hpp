// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace kerf {

/// Which device is held.
enum class Personality : std::uint8_t { omni, falcon, woodenhaptics };

inline constexpr std::array<std::string_view, 3> kPersonalityWords{"omni", "falcon",
                                                                   "woodenhaptics"};

}  // namespace kerf
