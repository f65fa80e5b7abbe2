// SPDX-License-Identifier: Apache-2.0
#include "record/packed_npy.hpp"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/temporary_folder.hpp"

namespace kerf::packed_npy_test {

using kerf::test::TemporaryFolder;

namespace {

constexpr const char* kHeader = "header";
constexpr std::size_t kBytes = 300'000;  // far beyond the buffers of zlib

/// Whether the file holds the header, one array of this size, and nothing else.
bool is_complete(const std::filesystem::path& path) {
  PackedNpyReader reader(path, kHeader);
  std::vector<std::byte> content(kBytes);
  return reader.read(content) && reader.at_end();
}

}  // namespace

TEST_CASE("a packed array that lacks any of its last bytes is not complete") {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "array.npy.gz";
  std::vector<std::byte> content(kBytes);
  for (std::size_t i = 0; i < content.size(); ++i) content[i] = std::byte(i * i % 251);
  AtomicFile file(path);
  write_packed_npy(file, kHeader, content);
  file.commit();
  CHECK(is_complete(path));
  const std::filesystem::path whole = folder.path() / "whole";
  std::filesystem::copy_file(path, whole);
  const auto bytes = std::filesystem::file_size(path);
  for (std::uintmax_t cut = 1; cut < bytes; cut = cut < 20 ? cut + 1 : 2 * cut) {
    std::filesystem::copy_file(whole, path, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(path, bytes - cut);
    INFO("without its last ", cut, " bytes");
    CHECK(!is_complete(path));
  }
}

}  // namespace kerf::packed_npy_test
