// SPDX-License-Identifier: Apache-2.0
#include "lab/program.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "lab/run/lab_run.hpp"

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
  CHECK(answer.complained.find("kerf-lab: --report /nonexistent/bench.json: cannot be written") ==
        0);
}

TEST_CASE("a core that does not exist is refused, and no report is left behind") {
  const auto file = std::filesystem::temp_directory_path() / "kerf-lab-test.json";
  const Answer answer = lab({"bench", "--cpu", "1000", "--report", file.c_str()});
  CHECK(answer.code == 2);
  CHECK(answer.complained.find("--cpu 1000") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(file));
  CHECK_FALSE(std::filesystem::exists(file.string() + ".part"));
}

TEST_CASE("accuracy refuses a file or a core that cannot be, before anything is measured") {
  for (const char* option : {"--report", "--csv", "--plot", "--page"}) {
    const Answer answer = lab({"accuracy", option, "/nonexistent/a.md"});
    CHECK(answer.code == 2);
    CHECK(answer.complained.find("/nonexistent/a.md: cannot be written") != std::string::npos);
  }
  const Answer answer = lab({"accuracy", "--cpu", "1000"});
  CHECK(answer.code == 2);
  CHECK(answer.complained.find("--cpu 1000") != std::string::npos);
}

TEST_CASE("two outputs that are one file are refused before anything is measured") {
  const auto folder = std::filesystem::temp_directory_path();
  const std::string file = folder / "kerf-lab-same";
  const std::string same = folder / "." / "kerf-lab-same";
  const Answer answer = lab({"accuracy", "--csv", file.c_str(), "--report", same.c_str()});
  CHECK(answer.code == 2);
  CHECK(answer.said.empty());
  CHECK(answer.complained ==
        "kerf-lab: --csv " + file + ": --report writes there, too; give each a file of its own\n");
  const std::string svg = folder / "kerf-lab-same.svg";
  CHECK(lab({"accuracy", "--page", svg.c_str()}).code == 2);
  CHECK(lab({"bench", "--page", file.c_str(), "--report", file.c_str()}).code == 2);
  const std::string scan = folder / "kerf-lab-same.nrrd";
  for (const char* option : {"--csv", "--report", "--page", "--plot"}) {
    CHECK(lab({"accuracy", option, scan.c_str()}).complained.find("writes no .nrrd; let it end") !=
          std::string::npos);
  }
}

TEST_CASE("nothing lies beside an output while a run measures, so that it may be stopped") {
  const auto folder = std::filesystem::temp_directory_path() / "kerf-lab-output-test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  const kerf::LabOutput output("--csv", folder / "a.csv", ".csv");
  CHECK(std::filesystem::is_empty(folder));
  output.write("figures\n");
  CHECK(std::filesystem::file_size(folder / "a.csv") == 8);
  std::filesystem::remove_all(folder);
}

TEST_CASE(
    "plots of a page lie in plots/ beside it; where nobody can make that folder, one line says "
    "so") {
  const auto folder = std::filesystem::temp_directory_path() / "kerf-lab-plots-test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  const std::string page = folder / "a.md";
  CHECK(kerf::page_plot("--page", "", ".svg").empty());
  const std::string plot = kerf::page_plot("--page", page, ".rates.svg");
  CHECK(plot == folder / "plots" / "a.rates.svg");
  CHECK(std::filesystem::is_directory(folder / "plots"));
  CHECK(kerf::page_link(page, plot) == "plots/a.rates.svg");
  CHECK(kerf::page_plot("--page", page, ".svg") == folder / "plots" / "a.svg");  // again
  std::filesystem::remove_all(folder / "plots");
  std::ofstream(folder / "plots") << "a file";
  const Answer answer = lab({"accuracy", "--page", page.c_str()});
  CHECK(answer.code == 2);
  CHECK(answer.said.empty());
  CHECK(answer.complained.starts_with("kerf-lab: --page " + page + ": its plots have no folder"));
  CHECK(std::ranges::count(answer.complained, '\n') == 1);
  std::filesystem::remove_all(folder);
}

TEST_CASE("faults runs from any folder, and names what it plays") {
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(std::filesystem::temp_directory_path());
  const Answer answer = lab({"faults", "--device", "falcon", "--rate", "250,500", "--scripts",
                             "hil/faults/parked_once.toml", "--random", "0", "--seeds", "1"});
  std::filesystem::current_path(here);
  CHECK(answer.complained.empty());
  CHECK(answer.code == 0);
  CHECK(answer.said.find("2 runs, 0 show nothing, 0 rules broken") != std::string::npos);
}

TEST_CASE("faults refuses what cannot be played, before anything is") {
  const Answer rate = lab({"faults", "--rate", "1000,3000"});
  CHECK(rate.code == 2);
  CHECK(rate.complained.find("--rate: 3000 does not divide 8000") != std::string::npos);
  const Answer pots = lab(
      {"faults", "--device", "falcon", "--random", "0", "--scripts", "hil/faults/pot_noise.toml"});
  CHECK(pots.code == 2);
  CHECK(pots.complained.find("no device has what they break") != std::string::npos);
  CHECK(lab({"faults", "--model", "springs"}).code == 2);
  CHECK(lab({"faults", "--scripts", "/nonexistent"}).code == 2);
}

TEST_CASE("faults calls a run whose hand felt nothing an error") {
  const auto hand = std::filesystem::temp_directory_path() / "kerf-hand-in-the-air.toml";
  std::ofstream(hand) << "start_mm = [0, 20, 0]\n[[step]]\nhold = 1\n";
  const Answer answer = lab({"faults", "--device", "omni", "--random", "0", "--scripts",
                             "hil/faults/lost_long.toml", "--seeds", "2", "--hand", hand.c_str()});
  std::filesystem::remove(hand);
  CHECK(answer.code == 1);
  CHECK(answer.said.find("shows nothing: seed 1: the motors never pushed at the tip") !=
        std::string::npos);
  CHECK(answer.said.find("2 runs, 2 show nothing") != std::string::npos);
}
