// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace kerf {

/// Shortest text that reads back as the same number.
[[nodiscard]] std::string number_text(double value);

/// Six digits, for what was computed and need not be written down again.
[[nodiscard]] std::string short_text(double value);

/// `text` on one line: control characters become blanks, and what is too long to read is cut.
[[nodiscard]] std::string one_line(std::string_view text);

/// `a, b, c`.
[[nodiscard]] std::string listed(std::span<const std::string_view> names);

/// Throws SceneError `place: what`, on one line.
[[noreturn]] void refuse(std::string_view place, std::string_view what);

/// The known name that `word` was probably meant to be: the same quantity in another unit
/// (`radius_cm`, `radius` -> `radius_mm`), else the nearest in spelling; empty when none is near.
[[nodiscard]] std::string_view nearest(std::string_view word,
                                       std::span<const std::string_view> known);

}  // namespace kerf
