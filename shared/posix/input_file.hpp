// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace kerf {

/// A file that cannot be read, as `path: value; way out`.
struct InputFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The whole of a regular file of at most 1 MiB. Throws InputFileError, which names `example` if
/// there is none. Load time.
[[nodiscard]] std::string read_input_file(const std::filesystem::path& file,
                                          const std::string& example);

}  // namespace kerf
