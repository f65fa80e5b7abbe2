// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>

#include <doctest/doctest.h>

#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::unreachable_test {

namespace fs = std::filesystem;

TEST_CASE("links in a circle are told as such, where a file is read and where one is written") {
  const kerf::test::TemporaryFolder folder;
  fs::create_symlink("itself", folder / "itself");
  fs::create_symlink("there", folder / "here");
  fs::create_symlink("here", folder / "there");
  fs::create_symlink("nothing", folder / "dangling");
  const std::string why = ": cannot be reached (Too many levels of symbolic links); ";
  CHECK(access_error(folder / "itself").starts_with(why));
  CHECK(access_error(folder / "here/scene.toml").starts_with(why));
  CHECK(access_error(folder.path()) == "");
  CHECK(access_error(folder / "nothing") == "");
  CHECK(access_error(folder / "nothing/below") == "");
  CHECK(access_error(folder / "dangling") == "");
  const fs::path report = folder / "here/report.json";
  CHECK_THROWS_WITH_AS(kerf::check_new_file(report),
                       doctest::Contains((report.string() + why).c_str()), kerf::FileError);
}

}  // namespace kerf::unreachable_test
