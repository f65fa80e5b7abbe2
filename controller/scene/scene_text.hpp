// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "shared/text/number.hpp"
#include "shared/text/words.hpp"

namespace kerf {

/// Six digits, for what was computed and need not be written down again.
[[nodiscard]] std::string short_text(double value);

/// Throws SceneError `place: what`, on one line.
[[noreturn]] void refuse(std::string_view place, std::string_view what);

}  // namespace kerf
