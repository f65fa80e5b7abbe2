// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf {

/// Where a file or folder lies that comes with kerf, such as `scenes/touch.toml`: as it is named
/// where that exists, else beside the program or in a folder above it, at most six up; the name
/// itself where it lies nowhere, so that who opens it can complain. Start-up only.
[[nodiscard]] std::string shipped_file(const std::string& name);

}  // namespace kerf
