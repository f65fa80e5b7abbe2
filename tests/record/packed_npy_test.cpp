// SPDX-License-Identifier: Apache-2.0
#include "record/packed_npy.hpp"

#include <array>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include <doctest/doctest.h>

#include "tests/support/temporary_folder.hpp"

using namespace kerf;
using kerf::test::TemporaryFolder;

namespace {

constexpr const char* kHeader = "header";

/// Whether the file holds the header, one array of this size, and nothing else.
bool is_complete(const std::filesystem::path& path) {
  PackedNpyReader reader(path, kHeader);
  std::array<std::byte, 1000> content{};
  return reader.read(content) && reader.at_end();
}

}  // namespace

TEST_CASE("a packed array that lacks any of its last bytes is not complete") {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "array.npy.gz";
  std::array<std::byte, 1000> content{};
  for (std::size_t i = 0; i < content.size(); ++i) content[i] = std::byte(i * i % 251);
  AtomicFile file(path);
  write_packed_npy(file, kHeader, content);
  file.commit();
  CHECK(is_complete(path));
  const auto bytes = std::filesystem::file_size(path);
  for (std::uintmax_t cut = 1; cut < bytes; ++cut) {
    std::filesystem::resize_file(path, bytes - cut);
    INFO("without its last ", cut, " bytes");
    CHECK(!is_complete(path));
  }
}
