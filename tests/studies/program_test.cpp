// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include <doctest/doctest.h>

#include "tests/programs/pair.hpp"
#include "tests/studies/studies_line.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::program_test {

using kerf::test::cases_in, kerf::test::has, kerf::test::kBin, kerf::test::LabAnswer,
    kerf::test::Process, kerf::test::studies, kerf::test::TemporaryFolder;
using namespace std::chrono_literals;

TEST_CASE("the studies have help and a version") {
  CHECK(studies("--help").code == 0);
  CHECK(has(studies("extremes --help").out, "--presses"));
  CHECK(has(studies("--version").out, KERF_VERSION));
}

// tests/errors/cases.txt has the texts.
TEST_CASE("a study that cannot be is refused before anything is measured, and leaves no file") {
  const TemporaryFolder folder;
  const std::string report = (folder / "report.json").string();
  for (const std::string& line : cases_in(
           "extremes --cpu 1000 --report " + report +
           "; extremes --page /nonexistent/contact.md; ranges --numeric real; ranges --hours nan; "
           "ranges --combinations -1; ranges --report /nonexistent/rows.json")) {
    const LabAnswer answer = studies(line);
    CAPTURE(line);
    CHECK(answer.code == 2);
    CHECK(answer.out.empty());
    CHECK(std::ranges::count(answer.err, '\n') == 1);
  }
  CHECK(folder.count() == 0);
}

TEST_CASE("ranges that is asked to end leaves nothing behind") {
  const TemporaryFolder folder;
  setenv("TMPDIR", folder.path().c_str(), 1);
  Process process({kBin + "/kerf-studies", "ranges", "--combinations", "0", "--hours", "24"},
                  folder / "log");
  unsetenv("TMPDIR");
  const auto files = [&] {
    return std::distance(std::filesystem::directory_iterator(folder.path()), {});
  };
  REQUIRE(kerf::test::eventually([&] { return files() == 2; }, 60s));
  process.signal(SIGTERM);
  CHECK(process.wait() == 130);
  CHECK(files() == 1);  // the log
}

}  // namespace kerf::program_test
