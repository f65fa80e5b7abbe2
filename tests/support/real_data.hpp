// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include <doctest/doctest.h>

namespace kerf::test {

/// A file or folder below $KERF_DATA, the folder of real volumes. If it is missing: none, with a
/// message that a part of the test is skipped.
[[nodiscard]] inline std::optional<std::filesystem::path> real_data(const std::string& name) {
  const char* const folder = std::getenv("KERF_DATA");
  if (folder == nullptr || !std::filesystem::is_directory(folder)) {
    MESSAGE("skipped: no real volumes; KERF_DATA names their folder");
    return std::nullopt;
  }
  std::filesystem::path file = std::filesystem::path(folder) / name;
  if (std::filesystem::exists(file)) return file;
  MESSAGE("skipped: " << name << " is not in the folder that KERF_DATA names");
  return std::nullopt;
}

}  // namespace kerf::test
