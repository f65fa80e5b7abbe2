// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace kerf::sweep {

/// A program of kerf, started; ended with its owner. What it says on either stream goes to a file.
class Child {
 public:
  /// Throws `HilError` where it cannot be started.
  Child(const std::vector<std::string>& arguments, std::filesystem::path output);
  /// Asked to end, and killed after two seconds.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Exit code, or 128 + signal; nothing while it runs.
  [[nodiscard]] std::optional<int> ended();
  void signal(int number);
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  /// The last line that it said; empty: none.
  [[nodiscard]] std::string last_line() const;

 private:
  pid_t pid_ = -1;
  std::optional<int> code_;
  std::filesystem::path output_;
};

/// Path of a program of kerf, by its short name: it lies beside this one.
[[nodiscard]] std::string program_beside(const char* name);

}  // namespace kerf::sweep
