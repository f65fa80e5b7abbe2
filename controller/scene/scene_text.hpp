// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "shared/text/number.hpp"
#include "shared/text/words.hpp"

namespace kerf {

/// Six digits, for what was computed and need not be written down again.
[[nodiscard]] std::string short_text(double value);

/// Throws SceneError `place: what`, on one line.
[[noreturn]] void refuse(std::string_view place, std::string_view what);

/// The known name that `word` was probably meant to be: the same quantity in another unit
/// (`radius_cm`, `radius` -> `radius_mm`), else the nearest in spelling; empty when none is near.
[[nodiscard]] std::string_view nearest(std::string_view word,
                                       std::span<const std::string_view> known);

}  // namespace kerf
