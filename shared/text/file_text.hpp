// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

namespace kerf {

/// The bytes of a file; none where it cannot be read, or is a pipe or device, whose writer might
/// never come. In blocks: a byte at a time, a program of 60 MB would take five seconds under a
/// sanitizer.
[[nodiscard]] inline std::string text_in(const std::filesystem::path& path) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(path, fault)) return {};
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return std::move(text).str();
}

}  // namespace kerf
