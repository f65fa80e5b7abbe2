// SPDX-License-Identifier: Apache-2.0
// What the window offers to open, and what it says of folders and files that give nothing.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <unistd.h>

#include "tests/support/temporary_folder.hpp"
#include "visualizer/panels/control_panels.hpp"

namespace kerf::folder_list_test {

using namespace kerf::test;
namespace fs = std::filesystem;

namespace {

bool is_one_line(const std::string& text) {
  return !text.empty() && text.find('\n') == std::string::npos;
}

}  // namespace

TEST_CASE("a folder lists the one above, folders, scenes and volumes, and nothing else") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "zoo");
  fs::create_directory(folder / ".hidden");
  for (const char* name : {"b.toml", "a.NRRD", "scan.nii.gz", "readme.md", ".dot.toml"}) {
    folder.write(name, "");
  }
  fs::create_symlink(folder / "gone", folder / "link.toml");
  const FolderList list = list_folder(folder.path());
  using Entry = FolderList::Entry;
  const std::vector<Entry> expected{
      {"..", true}, {"zoo", true}, {"a.NRRD"}, {"b.toml"}, {"scan.nii.gz"}};
  CHECK(list.entries == expected);
  CHECK(list.note.empty());
  CHECK(list_folder(folder.path() / "").folder == folder.path());
  CHECK(list_folder("/").entries.front().name != "..");
}

TEST_CASE("a folder that gives nothing says why in one line, and leads out") {
  const TemporaryFolder folder;
  for (const fs::path& path : {folder.path(), folder / "missing", folder.write("x.toml", "")}) {
    CAPTURE(path.string());
    if (path == folder.path()) fs::remove(folder / "x.toml");
    const FolderList list = list_folder(path);
    CHECK(list.entries.size() == 1);
    CHECK(list.entries.front().name == "..");
    CHECK(is_one_line(list.note));
    CHECK(list.note.find("; choose another folder") != std::string::npos);
  }
  if (::geteuid() != 0) {  // who may read all is refused nothing
    fs::permissions(folder.path(), fs::perms::none);
    CHECK(is_one_line(list_folder(folder.path()).note));
    fs::permissions(folder.path(), fs::perms::owner_all);
  }
}

TEST_CASE("of thousands of files the first ones are listed, and it is said") {
  const TemporaryFolder folder;
  for (int i = 0; i < 3000; ++i) folder.write("v" + std::to_string(10'000 + i) + ".nrrd", "");
  const FolderList list = list_folder(folder.path());
  CHECK(list.entries.size() == FolderList::kMost);
  CHECK(list.entries[1].name == "v10000.nrrd");
  CHECK(is_one_line(list.note));
}

TEST_CASE("a file that is no scene is told from one, without reading it all") {
  const TemporaryFolder folder;
  CHECK(why_not_open(folder.write("s.toml", "# a scene\n  [[volume]]\nfile = \"x\"\n")).empty());
  CHECK(why_not_open(folder.write("t.nrrd", "")).empty());  // the controller reads it
  for (const fs::path& file : {folder.write("c.toml", "[tool]\nname = \"volume\"\n"),
                               folder.write("e.toml", ""), folder / "missing.toml"}) {
    const std::string why = why_not_open(file);
    CHECK(is_one_line(why));
    CHECK(why.find("; choose another file") != std::string::npos);
  }
}

}  // namespace kerf::folder_list_test
