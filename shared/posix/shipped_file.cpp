// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/shipped_file.hpp"

#include <filesystem>
#include <system_error>

namespace kerf {

std::string shipped_file(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (name.empty() || fs::exists(name, error)) return name;
  constexpr int kMostUp = 6;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up <= kMostUp && !folder.empty(); ++up) {
    for (const fs::path& place : {folder / name, folder / "share/kerf" / name}) {
      if (fs::exists(place, error)) return place.string();
    }
    if (folder == folder.root_path()) break;
    folder = folder.parent_path();
  }
  return name;
}

}  // namespace kerf
