// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "shared/posix/atomic_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::file_text_test {

TEST_CASE("a file's bytes come whole; what cannot be read has none") {
  const kerf::test::TemporaryFolder folder;
  std::string all;
  for (int i = 0; i < 100'000; ++i) all += static_cast<char>(i);  // more than a block, zeros too
  CHECK(text_in(folder.write("all", all)) == all);
  CHECK(text_in(folder.write("empty", "")).empty());
  CHECK(text_in(folder / "missing").empty());
  CHECK(text_in(folder.path()).empty());
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(text_in(folder / "pipe").empty());  // and does not wait for a writer
}

}  // namespace kerf::file_text_test
