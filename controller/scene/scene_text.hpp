// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "shared/text/number.hpp"
#include "shared/text/words.hpp"

namespace kerf {

/// Six digits, for what was computed and need not be written down again.
[[nodiscard]] std::string short_text(double value);

/// `0.0001 to 100000`: without exponents.
[[nodiscard]] std::string range_text(double lo, double hi);

/// Throws SceneError `place: what`, on one line.
[[noreturn]] void refuse(std::string_view place, std::string_view what);

}  // namespace kerf
