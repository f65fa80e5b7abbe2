// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/input_file.hpp"

#include <cerrno>
#include <cstddef>
#include <fstream>
#include <ios>
#include <system_error>

#include "shared/posix/error_text.hpp"

namespace kerf {

std::string read_input_file(const std::filesystem::path& file, const std::string& example) {
  constexpr std::size_t kMaxBytes = 1 << 20;
  const std::string location = file.string();
  std::error_code error;
  if (const std::string why = access_error(file); !why.empty())
    throw InputFileError(location + why);
  if (!std::filesystem::is_regular_file(file, error)) {
    throw InputFileError(location + ": not a file; name one such as " + example);
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw InputFileError(location + ": " + std::generic_category().message(errno) + "; " +
                         remedy_for(errno, "check its rights"));
  }
  std::string text(kMaxBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad() || (!in.eof() && text.size() <= kMaxBytes)) {
    throw InputFileError(location + ": cannot be read; check its rights");
  }
  if (text.size() > kMaxBytes) {
    throw InputFileError(location + ": more than 1 MiB; use a shorter one");
  }
  return text;
}

}  // namespace kerf
