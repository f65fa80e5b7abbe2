// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/folder_files.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::folder_files_test {

using namespace kerf::test;
using volume::FolderFiles, volume::VolumeKind;

namespace {

/// Begins as a DICOM file; names alone, and these bytes, choose the kind of a folder.
const std::string kDicom = std::string(128, '\0') + "DICM";

FolderFiles files_of(const std::vector<std::string>& names, const std::string& top = "") {
  const TemporaryFolder folder;
  for (const std::string& name : names) {
    const bool slice = name.find("I0") != std::string::npos;
    static_cast<void>(folder.write(name, slice ? kDicom : "x"));
  }
  FolderFiles found = volume::files_of_volume(folder.path().string() + top);
  for (auto& file : found.files) file = file.lexically_relative(folder.path());
  return found;
}

std::vector<std::string> names_of(const FolderFiles& found) {
  std::vector<std::string> names;
  for (const auto& file : found.files) names.push_back(file.string());
  return names;
}

std::string refused(const std::vector<std::string>& names) {
  try {
    static_cast<void>(files_of(names));
  } catch (const LoadError& error) {
    CHECK(is_one_line(error.what()));
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("images below the top folder of a disc are found beside its readme and its index") {
  const FolderFiles disc =
      files_of({"README.TXT", "AUTORUN.INF", "DICOMDIR", "DICOM/S1/I0010", "DICOM/S1/I002"});
  CHECK(disc.kind == VolumeKind::dicom_series);
  CHECK(names_of(disc) ==
        std::vector<std::string>{"AUTORUN.INF", "DICOM/S1/I002", "DICOM/S1/I0010", "README.TXT"});
  CHECK(disc.note.empty());
}

TEST_CASE("slices of DICOM are found in the folder and below it, whatever lies at the top") {
  CHECK(files_of({"I01", "more/I02"}).files.size() == 2);
  CHECK(files_of({"a/b/c/d/e/I01", "a/I02"}).files.size() == 2);
  const FolderFiles deep = files_of({"a/b/c/d/e/f/I01", "a/I02"});
  CHECK(deep.files.size() == 1);
  CHECK(has(deep.note, "more than 5 levels below are not searched"));
  CHECK(files_of({".hidden/I01", "._I02", "I03"}).files.size() == 1);
}

TEST_CASE("a DICOM file without a mark is known by its first element") {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("1", std::string("\x08\0\x05\0CS\x0a\0ISO_IR 100", 18)));
  static_cast<void>(folder.write("2.png", "x"));
  static_cast<void>(folder.write("3", std::string("\x08\0\x05\0CS\x0a\0ISO_IR 100", 18)));
  static_cast<void>(folder.write("4", std::string("\x02\0\x00\0UL\x04\0\0\0\0\0", 12)));
  CHECK(volume::files_of_volume(folder.path()).kind == VolumeKind::dicom_series);
}

TEST_CASE("a few pictures beside slices of DICOM are left out and named") {
  const FolderFiles few = files_of({"I01", "I02", "I03", "preview.png"});
  CHECK(few.kind == VolumeKind::dicom_series);
  CHECK(few.files.size() == 3);
  CHECK(has(few.note, "1 image of another kind or folder is not read, preview.png"));
  const FolderFiles logo = files_of({"logo.png", "CT/I01", "CT/I02", "CT/I03"});
  CHECK(logo.kind == VolumeKind::dicom_series);
  CHECK(has(logo.note, "logo.png"));
  const FolderFiles stack = files_of({"1.tif", "2.tif", "3.tif", "I01"});
  CHECK(stack.kind == VolumeKind::tiff_stack);
  CHECK(has(stack.note, "I01"));
}

TEST_CASE("as many pictures as slices of DICOM are two volumes, and refused by name") {
  const std::string message = refused({"I01", "I02", "1.png", "2.png"});
  CAPTURE(message);
  CHECK(has(message, "holds 2 DICOM (such as I01) and 2 PNG (such as 1.png)"));
  CHECK(has(refused({"a/I01", "a/I02", "a/I03", "b/1.tif", "b/2.tif"}), "3 DICOM"));
  CHECK(refused({"I01", "I02", "I03", "b/1.tif", "b/2.tif"}) == "no error");  // the top chooses
}

TEST_CASE("pictures of the top folder are not mixed with those below") {
  const FolderFiles masks = files_of({"2.png", "10.png", "masks/1.png", "masks/2.png"});
  CHECK(masks.kind == VolumeKind::png_stack);
  CHECK(names_of(masks) == std::vector<std::string>{"2.png", "10.png"});
  CHECK(has(masks.note, "2 images of another kind or folder are not read, such as masks/1.png"));
  CHECK(files_of({"2.png", "10.png", "masks/1.png"}, "/").files.size() == 2);
  CHECK(files_of({"notes.txt", "slices/1.png", "slices/2.png"}).files.size() == 2);
}

TEST_CASE("a folder without images, or without files, has none") {
  CHECK(files_of({"notes.txt"}).kind == VolumeKind::dicom_series);  // its reader refuses
  CHECK(files_of({}).files.empty());
}

}  // namespace kerf::folder_files_test
