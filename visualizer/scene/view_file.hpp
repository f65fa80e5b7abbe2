// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "shared/text/toml.hpp"

// What the small TOML files of a view share: opacities and camera.

namespace kerf {

/// The text of a regular file of at most 64 KiB. `what` it is, and how one comes to it, are for the
/// message. Throws VisualizerError: name, reason, way out.
[[nodiscard]] std::string read_view_file(const std::filesystem::path& file, const std::string& what,
                                         const std::string& way);

/// Throws VisualizerError for text that is no TOML: `name`, line, value, way out.
[[nodiscard]] TomlNode parse_view_file(std::string_view text, const std::string& name);

/// Throws VisualizerError of one line.
[[noreturn]] void refuse_in(const std::string& name, std::size_t line, const std::string& problem);

}  // namespace kerf
