// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <sstream>
#include <streambuf>
#include <string>

namespace kerf::volume {

/// Keeps what ITK, MetaIO and GDCM print to std::cerr and std::cout while it lives. In the
/// sandbox, where nobody else writes there.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

  /// MetaIO and GDCM only print that voxels are missing or cannot be unpacked, and go on: throws
  /// SceneError for them. What is kept is of all files read since the beginning.
  void refuse_if_missing(const std::filesystem::path& path) const;

 private:
  std::ostringstream kept_;
  std::streambuf* cerr_;
  std::streambuf* cout_;
};

/// The last line of a library's message, which is the most precise one, without its prefix.
[[nodiscard]] std::string last_line(const std::string& message);

}  // namespace kerf::volume
