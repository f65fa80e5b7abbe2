// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace kerf {

/// What is told, after its name, of a place where nobody can say whether a file is there: a loop of
/// links, a folder of somebody else's. Empty: something is there, or nothing is.
[[nodiscard]] std::string why_unreachable(const std::filesystem::path& path);

}  // namespace kerf
