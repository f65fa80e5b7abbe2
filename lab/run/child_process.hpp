// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace kerf::sweep {

/// A program of kerf, started; ended with its owner. Both of its output streams go to a file.
class Child {
 public:
  /// Throws `HilError` if it cannot be started.
  Child(const std::vector<std::string>& arguments, std::filesystem::path output);
  /// Asked to end, and killed after two seconds.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Exit code, or 128 + signal; empty while it runs.
  [[nodiscard]] std::optional<int> ended();
  void signal(int number);
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  /// The last line of its output; empty if none.
  [[nodiscard]] std::string last_line() const;

 private:
  pid_t pid_ = -1;
  std::optional<int> code_;
  std::filesystem::path output_;
};

/// A folder of this process alone below $TMPDIR; goes with its owner. Throws `HilError`.
class PrivateFolder {
 public:
  /// `name` begins that of the folder.
  explicit PrivateFolder(const char* name);
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Path of a program of kerf, by its short name: it lies beside this one, and its name begins as
/// this one's, or it is in the folder of that name that `kerf_programs` makes (docs/own-law.md).
[[nodiscard]] std::string program_beside(const char* name);

}  // namespace kerf::sweep
