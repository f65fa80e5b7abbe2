// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>

namespace kerf {

/// A file that appears whole or not at all: written under a temporary name in the same folder, and
/// renamed by `commit`. Without it the destructor removes it, and what was there before stays.
///
/// Every failure (no folder, no right, disk full) is a SceneError that names the final path.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(const void* data, std::size_t size);
  /// Ends writing. Some file systems report a full disk only here.
  void close();
  /// After `close`.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int fd_ = -1;
  bool committed_ = false;
};

}  // namespace kerf
