// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace kerf {

/// Shortest text that reads back as the same number.
[[nodiscard]] std::string number_text(double value);

/// Six digits, for what was computed and need not be written down again.
[[nodiscard]] std::string short_text(double value);

/// `text` on one line: control characters become blanks, and what is too long to read is cut.
[[nodiscard]] std::string one_line(std::string_view text);

/// Throws SceneError `place: what`, on one line.
[[noreturn]] void refuse(std::string_view place, std::string_view what);

}  // namespace kerf
