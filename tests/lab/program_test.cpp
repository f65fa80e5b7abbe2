// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <string>

#include <doctest/doctest.h>

#include "lab/run/lab_run.hpp"
#include "tests/lab/lab_line.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::program_test {

using kerf::test::cases_in, kerf::test::has, kerf::test::lab, kerf::test::LabAnswer,
    kerf::test::TemporaryFolder;

TEST_CASE("help and version are no errors") {
  CHECK(lab("--help").code == 0);
  CHECK(has(lab("bench --help").out, "--report"));
  CHECK(has(lab("--version").out, KERF_VERSION));
}

// tests/errors/cases.txt has the texts.
TEST_CASE("what cannot be is refused before anything is measured, and leaves no file behind") {
  const TemporaryFolder folder;
  const std::string report = (folder / "report.json").string();
  for (const std::string& line : cases_in(
           "bench --report /nonexistent/b.json; bench --cpu 1000 --report " + report +
           "; accuracy --report /nonexistent/a.md; accuracy --csv /nonexistent/a.md; "
           "accuracy --plot /nonexistent/a.md; accuracy --page /nonexistent/a.md; "
           "accuracy --cpu 1000; "
           "faults --rate 1000,3000; faults --model springs; faults --device falcon --random 0 "
           "--scripts hil/faults/pot_noise.toml")) {
    const LabAnswer answer = lab(line);
    CAPTURE(line);
    CHECK(answer.code == 2);
    CHECK(answer.out.empty());
    CHECK(std::ranges::count(answer.err, '\n') == 1);
  }
  CHECK(folder.count() == 0);
}

TEST_CASE("two outputs that are one file are refused before anything is measured") {
  const TemporaryFolder folder;
  const std::string file = folder / "same", same = folder.path() / "." / "same";
  const LabAnswer answer = lab("accuracy --csv " + file + " --report " + same);
  CHECK(answer.code == 2);
  CHECK(answer.out.empty());
  CHECK(answer.err ==
        "kerf-lab: --csv " + file + ": --report writes there, too; give each its own file\n");
  CHECK(lab("accuracy --page " + file + ".svg").code == 2);
  CHECK(lab("bench --page " + file + " --report " + file).code == 2);
  for (const char* option : {"--csv", "--report", "--page", "--plot"}) {
    CHECK(has(lab("accuracy " + std::string(option) + " " + file + ".nrrd").err,
              "writes no .nrrd; let it end"));
  }
}

TEST_CASE("accuracy of a scene with two arms names the arm that it measures") {
  const LabAnswer answer = lab("accuracy --scene " KERF_TEST_SCENES "/two_arms.toml --cpu 1000");
  CHECK(answer.code == 2);  // the line comes before the measurement
  CHECK(has(answer.out, " of the first arm (the second arm's is not measured), voxels of "));
}

TEST_CASE("nothing lies beside an output while a run measures, so that it may be stopped") {
  const TemporaryFolder folder;
  const kerf::LabOutput output("--csv", folder / "a.csv", ".csv");
  CHECK(folder.count() == 0);
  output.write("figures\n");
  CHECK(std::filesystem::file_size(folder / "a.csv") == 8);
}

TEST_CASE("plots of a page lie in plots/ beside it; one line says if that cannot be made") {
  const TemporaryFolder folder;
  const std::string page = folder / "a.md";
  CHECK(kerf::page_plot("--page", "", ".svg").empty());
  const std::string plot = kerf::page_plot("--page", page, ".rates.svg");
  CHECK(plot == folder / "plots/a.rates.svg");
  CHECK(std::filesystem::is_directory(folder / "plots"));
  CHECK(kerf::page_link(page, plot) == "plots/a.rates.svg");
  CHECK(kerf::page_plot("--page", page, ".svg") == folder / "plots/a.svg");  // again
  std::filesystem::remove_all(folder / "plots");
  folder.write("plots", "a file");
  const LabAnswer answer = lab("accuracy --page " + page);
  CHECK(answer.code == 2);
  CHECK(answer.out.empty());
  CHECK(answer.err.starts_with("kerf-lab: --page " + page + ": its plots have no folder"));
  CHECK(std::ranges::count(answer.err, '\n') == 1);
}

TEST_CASE("faults runs from any folder, and names what it plays") {
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(std::filesystem::temp_directory_path());
  const LabAnswer answer =
      lab("faults --device falcon --rate 250,500 --scripts hil/faults/parked_once.toml --random 0 "
          "--seeds 1");
  std::filesystem::current_path(here);
  CHECK(answer.err.empty());
  CHECK(answer.code == 0);
  CHECK(has(answer.out, "2 runs, 0 show nothing, 0 rules broken"));
}

TEST_CASE("faults calls a run whose hand met nothing an error") {
  const TemporaryFolder folder;
  const std::string hand = folder.write("air.toml", "start_mm = [0, 20, 0]\n[[step]]\nhold = 1\n");
  const LabAnswer answer =
      lab("faults --device omni --random 0 --scripts hil/faults/lost_long.toml --seeds 2 --hand " +
          hand);
  CHECK(answer.code == 1);
  CHECK(has(answer.out, "shows nothing: seed 1: the motors never pushed at the tip"));
  CHECK(has(answer.out, "2 runs, 2 show nothing"));
}

}  // namespace kerf::program_test
