// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/new_files.hpp"

#include <cstddef>
#include <system_error>

namespace kerf {

NewFile& NewFiles::add(const std::filesystem::path& path) {
  return files_.emplace_back(path).file;
}

void NewFiles::commit() {
  for (Named& named : files_) named.file.commit();
}

std::optional<std::filesystem::path> NewFiles::commit_if_new() {
  const auto take_back = [&](std::size_t count) {
    std::error_code ignored;
    for (std::size_t i = 0; i < count; ++i) std::filesystem::remove(files_[i].path, ignored);
  };
  for (std::size_t i = 0; i < files_.size(); ++i) {
    try {
      if (files_[i].file.commit_if_new()) continue;
    } catch (const FileError&) {
      take_back(i);
      throw;
    }
    take_back(i);
    return files_[i].path;
  }
  return std::nullopt;
}

}  // namespace kerf
