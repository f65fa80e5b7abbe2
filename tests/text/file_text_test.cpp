// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "shared/text/text.hpp"

using kerf::text_in;

TEST_CASE("a file's bytes come whole; what cannot be read has none") {
  std::string name = (std::filesystem::temp_directory_path() / "kerf-text-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(name.data());
  std::string all;
  for (int i = 0; i < 100'000; ++i) all += static_cast<char>(i);  // more than a block, zeros too
  std::ofstream(folder / "all", std::ios::binary) << all;
  std::ofstream(folder / "empty");
  CHECK(text_in(folder / "all") == all);
  CHECK(text_in(folder / "empty").empty());
  CHECK(text_in(folder / "missing").empty());
  CHECK(text_in(folder).empty());
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(text_in(folder / "pipe").empty());  // and does not wait for a writer
  std::filesystem::remove_all(folder);
}
