// SPDX-License-Identifier: Apache-2.0
// What a run writes never takes the place of what it reads, nor of another kind of file.
#include <filesystem>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "shared/posix/atomic_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::run_files_test {

namespace fs = std::filesystem;
using kerf::test::TemporaryFolder;

namespace {

/// The one line with which outputs are refused, without the folder; empty: they are not.
std::string refusal(const std::vector<fs::path>& inputs,
                    const std::vector<kerf::OutputFile>& outputs) {
  try {
    kerf::check_outputs(inputs, outputs);
  } catch (const kerf::FileError& error) {
    return error.what();
  }
  return "";
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("an output that is an input is refused by whatever name") {
  const TemporaryFolder folder;
  const fs::path input = folder.write("a", "bytes");
  const std::string line = ": is a file of this run itself, which would be lost; give --report ";
  fs::create_hard_link(input, folder / "hard");
  fs::create_symlink(folder.path(), folder / "here");
  for (const char* name : {"a", "./a", "here/a", "hard", "here/./a"}) {
    const fs::path output = folder / name;
    CAPTURE(output);
    CHECK(
        refusal({"", input}, {{"--report", output, ".json"}}).starts_with(output.string() + line));
  }
  CHECK(refusal({input}, {{"--report", folder / "b", ".json"}}).empty());
  CHECK(fs::file_size(input) == 5);

  const fs::path nowhere = folder / "later";  // an input that the run itself makes
  CHECK(has(refusal({nowhere}, {{"--report", nowhere, ".json"}}), line));
}

TEST_CASE("an output in a folder that is read is refused") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "slices");
  fs::create_directory(folder / "slices-2");
  const std::string line = "which are read; name a place outside with --out";
  CHECK(has(refusal({folder / "slices"}, {{"--out", folder / "slices/a.nrrd", ".nrrd"}}), line));
  CHECK(has(refusal({folder / "slices/"}, {{"--out", folder / "slices/a.nrrd", ".nrrd"}}), line));
  CHECK(refusal({folder / "slices"}, {{"--out", folder / "slices-2/a.nrrd", ".nrrd"}}).empty());
  CHECK(refusal({folder / "slices"}, {{"--out", folder / "a.nrrd", ".nrrd"}}).empty());
}

TEST_CASE("an output whose name ends as another kind of file does is refused") {
  const TemporaryFolder folder;
  const auto told = [&](const char* name, std::string_view ending) {
    return refusal({}, {{"--report", folder / name, ending}});
  };
  CHECK(has(told("ct.nrrd", ".json"), "ct.nrrd: --report writes no .nrrd; "));
  CHECK(has(told("CT.NRRD", ".json"), "writes no .nrrd"));
  CHECK(has(told("ct.nii.gz", ".json"), "writes no .gz"));
  CHECK(has(told("s.toml", {}), "s.toml: --report writes no .toml; give a name without an ending"));
  for (const char* name : {"r.json", "r.JSON", "r", "r.txt", ".json"}) {
    CAPTURE(name);
    CHECK(told(name, ".json").empty());
  }
}

TEST_CASE("two outputs of a run are two files") {
  const TemporaryFolder folder;
  const fs::path one = folder / "one";
  CHECK(has(refusal({}, {{"--sheet", one, ".png"}, {"--report", folder / "./one", ".json"}}),
            "--sheet writes there, too; give each its own file"));
  CHECK(refusal({}, {{"--sheet", one, ".png"}, {"--report", "", ".json"}}).empty());
  CHECK(refusal({"/dev/null"}, {{"--a", "/dev/null", ".png"}, {"--b", "/dev/null", {}}}).empty());
  CHECK(fs::is_empty(folder.path()));
}

TEST_CASE("a dash is no standard output, and is told so") {
  CHECK(refusal({}, {{"--csv", "-", ".csv"}}) ==
        "-: --csv would make a file of that name; give /dev/stdout for standard output");
  CHECK(refusal({}, {{"--csv", "/dev/stdout", ".csv"}}).empty());
}

}  // namespace kerf::run_files_test
