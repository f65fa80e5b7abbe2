// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace kerf {

/// A Markdown page to which several programs write, each its own part between two comment lines:
/// `page` with the part `name` replaced by `text`, or with that part at its end where it had none.
[[nodiscard]] std::string with_part(std::string_view page, std::string_view name,
                                    std::string_view text);

/// The same with a file, which may be missing. Throws FileError.
void write_page_part(const std::filesystem::path& file, std::string_view name,
                     std::string_view text);

}  // namespace kerf
