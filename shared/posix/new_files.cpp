// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/new_files.hpp"

#include <cstddef>

namespace kerf {

NewFile& NewFiles::add(const std::filesystem::path& path) {
  return files_.emplace_back(path).file;
}

template <class Commit>
const NewFiles::Named* NewFiles::commit_all(Commit commit) {
  for (Named& named : files_) named.file.take_temporary_name();
  std::size_t done = 0;
  const auto take_back = [&] {
    while (done > 0) files_[--done].file.take_back();
  };
  try {
    for (; done < files_.size(); ++done) {
      const Named& named = files_[done];
      if (commit(files_[done].file)) continue;
      take_back();
      return &named;
    }
  } catch (const FileError&) {
    take_back();
    throw;
  }
  return nullptr;
}

void NewFiles::commit() {
  static_cast<void>(commit_all([](NewFile& file) {
    file.commit();
    return true;
  }));
}

std::optional<std::filesystem::path> NewFiles::commit_if_new() {
  const Named* const there = commit_all([](NewFile& file) { return file.commit_if_new(); });
  return there == nullptr ? std::nullopt : std::optional(there->path);
}

}  // namespace kerf
