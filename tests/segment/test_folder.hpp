// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <doctest/doctest.h>
#include <stdlib.h>

namespace kerf::test {

/// A folder for one test, removed with it.
class ScratchFolder {
 public:
  ScratchFolder() {
    char path[] = "/tmp/kerf-test-XXXXXX";
    REQUIRE(mkdtemp(path) != nullptr);
    path_ = path;
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Also the runtime folder of the sockets that are made while it lives.
class TestFolder : public ScratchFolder {
 public:
  TestFolder() { setenv("XDG_RUNTIME_DIR", path().c_str(), 1); }
  ~TestFolder() { unsetenv("XDG_RUNTIME_DIR"); }
};

}  // namespace kerf::test
