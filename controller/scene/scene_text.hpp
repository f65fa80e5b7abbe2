// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "shared/text/number.hpp"
#include "shared/text/words.hpp"

namespace kerf {

/// Six digits, for what was computed and need not be written down again.
[[nodiscard]] std::string short_text(double value);

/// `0.0001 to 100000`: without exponents.
[[nodiscard]] std::string range_text(double lo, double hi);

inline constexpr std::size_t kLongestText = 256;  // bytes of a name or a path

/// True for 1 to kLongestText bytes that print on one line.
[[nodiscard]] bool is_usable_text(std::string_view text);

/// Throws SceneError `place: what`, on one line.
[[noreturn]] void refuse(std::string_view place, std::string_view what);

}  // namespace kerf
