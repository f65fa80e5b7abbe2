// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/program.hpp"

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

namespace {

struct Answer {
  int code;
  std::string said, complained;
};

Answer lab(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "kerf-lab");
  std::ostringstream out, err;
  const int code = kerf::run_lab(static_cast<int>(arguments.size()), arguments.data(), out, err);
  return {code, out.str(), err.str()};
}

}  // namespace

TEST_CASE("help and version are no errors; a missing or unknown command is") {
  CHECK(lab({"--help"}).code == 0);
  CHECK(lab({"bench", "--help"}).said.find("--report") != std::string::npos);
  CHECK(lab({"--version"}).said.find(KERF_VERSION) != std::string::npos);
  CHECK(lab({}).code == 2);
  CHECK(lab({"bunch"}).code == 2);
}

TEST_CASE("a report that cannot be written is refused before anything is measured") {
  const Answer answer = lab({"bench", "--report", "/nonexistent/bench.json"});
  CHECK(answer.code == 2);
  CHECK(answer.said.empty());
  CHECK(answer.complained ==
        "kerf-lab: --report /nonexistent/bench.json: cannot be written; check the folder and its "
        "rights\n");
}

TEST_CASE("a core that does not exist is refused, and no report is left behind") {
  const auto file = std::filesystem::temp_directory_path() / "kerf-lab-test.json";
  const Answer answer = lab({"bench", "--cpu", "1000", "--report", file.c_str()});
  CHECK(answer.code == 2);
  CHECK(answer.complained.find("--cpu 1000") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(file));
  CHECK_FALSE(std::filesystem::exists(file.string() + ".part"));
}
