// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <doctest/doctest.h>
#include <stdlib.h>

namespace kerf::test {

/// A folder for one test, removed with it; also the runtime folder of the sockets made in it.
class TestFolder {
 public:
  TestFolder() {
    char path[] = "/tmp/kerf-test-XXXXXX";
    REQUIRE(mkdtemp(path) != nullptr);
    path_ = path;
    setenv("XDG_RUNTIME_DIR", path, 1);
  }
  ~TestFolder() {
    unsetenv("XDG_RUNTIME_DIR");
    std::filesystem::remove_all(path_);
  }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace kerf::test
