// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/view_file.hpp"

#include <cstdint>
#include <fstream>
#include <ios>
#include <system_error>

#include "shared/posix/error_text.hpp"
#include "shared/text/text.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

std::string read_view_file(const std::filesystem::path& file, const std::string& what,
                           const std::string& way) {
  constexpr std::uintmax_t kLargest = 1 << 16;
  std::error_code fault;
  if (std::filesystem::is_directory(file, fault)) {
    throw VisualizerError(file.string() + ": is a folder; name a file in it");
  }
  if (const std::string why = access_error(file); !why.empty()) {
    throw VisualizerError(file.string() + why);
  }
  if (!std::filesystem::is_regular_file(file, fault)) {
    const bool there = std::filesystem::exists(file, fault);
    throw VisualizerError(file.string() + (there ? ": is no regular file" : ": no such file") +
                          "; " + way);
  }
  const std::uintmax_t size = std::filesystem::file_size(file, fault);
  if (fault || size > kLargest) {
    throw VisualizerError(file.string() + ": no " + what +
                          ", it is larger than 64 KiB; name another file");
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(size, '\0');
  if (!stream.read(text.data(), static_cast<std::streamsize>(size)))
    throw VisualizerError(file.string() + ": cannot be read; check its permissions");
  return text;
}

TomlNode parse_view_file(std::string_view text, const std::string& name) {
  try {
    return parse_toml(text);
  } catch (const TomlError& error) {
    refuse_in(name, error.line, error.what());
  }
}

void refuse_in(const std::string& name, std::size_t line, const std::string& problem) {
  throw VisualizerError(name + ":" + std::to_string(line) + ": " + one_line(problem));
}

}  // namespace kerf
