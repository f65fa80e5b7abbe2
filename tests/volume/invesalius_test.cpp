// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::invesalius_test {

using namespace kerf::test;

namespace {

using Three = std::array<double, 3>;

/// A file in a tar archive (POSIX.1-1988, ustar).
std::string tar_file(const std::string& name, const std::string& content, char type = '0') {
  std::string header(512, '\0');
  const auto put = [&](std::size_t at, const std::string& text) {
    header.replace(at, text.size(), text);
  };
  const auto octal = [](std::size_t value, int digits) {
    char text[32];
    std::snprintf(text, sizeof text, "%0*zo", digits, value);
    return std::string(text);
  };
  put(0, name);
  put(100, "0000644");
  put(108, "0000000");
  put(116, "0000000");
  put(124, octal(content.size(), 11));
  put(136, "00000000000");
  put(148, "        ");
  header[156] = type;
  put(257, std::string("ustar\00000", 8));
  std::size_t sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  put(148, octal(sum, 6) + std::string("\0 ", 2));
  return header + content + std::string((512 - content.size() % 512) % 512, '\0');
}
const std::string kEnd(1024, '\0');

struct Project {
  std::string shape{"<integer>5</integer><integer>4</integer><integer>3</integer>"};
  std::string dtype{"int16"}, orientation{"<integer>1</integer>"};
  std::string spacing{"<real>1</real><real>2.0</real><real>3</real>"};
  std::string more{};
  std::string matrix{bytes_of(counting<std::int16_t>())};
};

std::string plist(const Project& project) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!DOCTYPE plist PUBLIC \"-//Apple//DTD PLIST "
         "1.0//EN\" \"http://www.apple.com/DTDs/PropertyList-1.0.dtd\">\n<plist "
         "version=\"1.0\">\n<dict>\n<key>masks</key><dict><key>spacing</key><string>no</string>"
         "<key>0</key><string>mask_0.plist</string></dict>\n<key>matrix</key>\n<dict>\n"
         "<key>dtype</key><string>" +
         project.dtype +
         "</string>\n<key>filename</key><string>matrix.dat</string>\n<key>shape</key><array>" +
         project.shape + "</array></dict>\n<key>modality</key><string>CT</string>\n" +
         "<key>orientation</key>" + project.orientation + "\n<key>spacing</key><array>" +
         project.spacing + "</array>\n" + project.more + "</dict></plist>\n";
}

/// As Python writes it: a header of its own with the time before each file, the list at the end.
std::string archive(const Project& project) {
  const auto file = [](const std::string& name, const std::string& content) {
    return tar_file("PaxHeaders/" + name, "20 mtime=1347635288.7\n", 'x') +
           tar_file("tmpab/" + name, content);
  };
  return file("mask_0.dat", "mask") + file("matrix.dat", project.matrix) +
         file("main.plist", plist(project)) + kEnd;
}

std::string affine(const std::string& numbers) {
  std::string text = "<key>affine</key><array>";
  std::istringstream words(numbers);
  for (std::string word; words >> word;) text += "<real>" + word + "</real>";
  return text + "</array>";
}

/// The frame of a matrix without a position, by the directions of its steps.
FilePlaces along(double x, double y) {
  return {.origin = {}, .steps = {{{x, 0, 0}, {0, y, 0}, {0, 0, 3}}}};
}

}  // namespace

TEST_CASE("a project of InVesalius is read, packed or not, and its patient is not mirrored") {
  const TemporaryFolder folder;
  for (const std::string& bytes : {archive({}), gzipped(archive({}))}) {
    const SourceVolume v = read_volume(folder.write("a.inv3", bytes));
    CHECK(v.grid == kSmall);
    CHECK(v.spacing_mm == Three{1, 2, 3});
    CHECK(v.min == 0);
    CHECK(v.max == 59);
    // Rows go from the front of the patient to the back in DICOM, and against that in the matrix.
    CHECK(misplaced(v, along(1, -2)) == "");
    CHECK(has(v.note, "keeps no directions of the patient"));
  }
}

TEST_CASE("the matrix of an InVesalius project lies as its slices did, if the project says how") {
  const TemporaryFolder folder;
  const auto read = [&](const char* orientation, const std::string& more) {
    Project project{.more = more};
    project.orientation = std::string("<integer>") + orientation + "</integer>";
    return read_volume(folder.write("a.inv3", archive(project)));
  };
  const auto told = [](const std::string& numbers) {
    std::string text = affine(numbers);
    return text.replace(5, 6, "patient_orientation");
  };
  const SourceVolume coronal = read("2", "");
  CHECK(has(coronal.note, "coronal DICOM"));
  CHECK(misplaced(coronal, along(1, -2)) == "");
  const SourceVolume sagittal = read("3", "");
  CHECK(has(sagittal.note, "sagittal DICOM"));
  CHECK(misplaced(sagittal, along(-1, 2)) == "");
  // A patient who lies on the belly: rows and columns go against those of one on the back.
  const SourceVolume prone = read("1", told("-1 0 0 0 -1 0"));
  CHECK_FALSE(has(prone.note, "directions"));
  CHECK(misplaced(prone, along(-1, 2)) == "");
  // Sagittal slices whose normal goes to the left.
  CHECK(misplaced(read("3", told("0 -1 0 0 0 -1")), along(1, -2)) == "");
  // Of a NIfTI file: matrix and affine as img2memmap and OpenOtherFiles make them from voxels in
  // RAS with the origin (10, 20, 30), the first axis turned to the front.
  const SourceVolume nifti = read("2", affine("0 1 0 -20  -1 0 0 10  0 0 1 -30  0 0 0 1"));
  CHECK(nifti.note.empty());
  // Voxel (0, 0, 0) of the matrix is (0, 3, 0) of the file, its rows are reversed.
  CHECK(misplaced(nifti, {.origin = {-(10 - 2.0 * 3), -20, 30},
                          .steps = {{{0, -1, 0}, {-2, 0, 0}, {0, 0, 3}}}}) == "");
}

TEST_CASE("numbers of a project are read in each type, and a spacing of 0 is asked for") {
  const TemporaryFolder folder;
  Project bytes{.dtype = "uint8", .matrix = bytes_of(counting<std::uint8_t>())};
  CHECK(read_volume(folder.write("a.inv3", archive(bytes))).max == 59);
  Project doubles{.dtype = "float64", .matrix = bytes_of(counting<double>())};
  CHECK(read_volume(folder.write("a.inv3", archive(doubles))).max == 59);
  Project flat{.spacing = "<real>1</real><real>2</real><real>0.0</real>"};
  const auto path = folder.write("a.inv3", archive(flat));
  CHECK(has(refusal(path), "spacing along z is not in the file; add `spacing_mm = [1, 2, z]`"));
  CHECK(read_volume(path, {.spacing_mm = Three{1, 2, 3}}).spacing_mm == Three{1, 2, 3});
  CHECK(has(refusal(path, {.spacing_mm = Three{2, 1, 3}}), "2 mm along x is given"));
}

TEST_CASE("a project that is not whole, or no project, is refused in one line") {
  const TemporaryFolder folder;
  const std::string whole = archive({});
  const std::string packed = gzipped(whole);
  std::string flipped = packed;
  flipped[flipped.size() - 6] ^= 1;  // of the checksum
  const auto with = [](const auto& change) {
    Project project;
    change(project);
    return archive(project);
  };
  const std::pair<std::string, const char*> kBad[] = {
      {"", "no whole InVesalius project"},
      {"no archive at all", "no whole InVesalius project"},
      {whole.substr(0, 3000), "no whole InVesalius project"},
      {packed.substr(0, packed.size() / 2), "no whole InVesalius project"},
      {flipped, "no whole InVesalius project"},
      {tar_file("a/other", "x") + kEnd, "holds no main.plist"},
      {tar_file("a/main.plist", plist({})) + tar_file("b/main.plist", plist({})) + kEnd,
       "two main"},
      {tar_file("a/main.plist", plist({})) + kEnd, "'a/matrix.dat' is missing"},
      {tar_file("a/main.plist", plist({})) + tar_file("b/matrix.dat", "x") + kEnd, "is missing"},
      {tar_file("a/main.plist", "<plist><dict>") + kEnd, "its main.plist is no XML"},
      {tar_file("a/main.plist", std::string((1 << 20) + 1, ' ')) + kEnd, "above 1 MiB"},
      {with([](Project& p) { p.shape = "<integer>60</integer>"; }),
       "matrix/shape has not 3 numbers"},
      {with([](Project& p) { p.shape = ""; }), "no shape of three"},
      {with([](Project& p) { p.shape = "<integer>0</integer><real>4</real><real>3</real>"; }), "0"},
      {with([](Project& p) { p.shape = "<real>9e18</real><real>4</real><real>3</real>"; }),
       "9e+18"},
      {with([](Project& p) { p.shape = "<real>4.5</real><real>4</real><real>3</real>"; }), "4.5"},
      {with([](Project& p) { p.dtype = "complex64"; }), "'complex64' numbers"},
      {with([](Project& p) { p.matrix.pop_back(); }), "119 of 120 bytes"},
      {with([](Project& p) { p.matrix += "x"; }), "121 bytes where its shape asks for 120"},
      {with([](Project& p) { p.orientation = "<integer>4</integer>"; }), "orientation is '4'"},
      {with([](Project& p) { p.orientation = ""; }), "orientation is ''"},
      {with([](Project& p) { p.spacing = ""; }), "spacing is not in the file"},
      {with([](Project& p) { p.spacing = "<real>1</real>"; }), "spacing has not 3 numbers"},
      {with([](Project& p) { p.spacing = "<real>1</real><real>nan</real><real>1</real>"; }),
       "spacing has not 3 numbers"},
      {with([](Project& p) { p.more = "<key>patient_orientation</key><string>L</string>"; }),
       "patient_orientation has not 6 numbers"},
      {with([](Project& p) { p.more = affine("1 0 0"); }), "affine has not 16 numbers"},
      {with([](Project& p) { p.more = "<key>affine</key><string></string>"; }), "no error"},
      {with([](Project& p) { p.spacing = "<real>1</real><real>-2</real><real>3</real>"; }),
       "1 -2 3 mm is not a voxel size"},
      {with([](Project& p) { p.more = affine("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"); }),
       "not at right angles"},
      {with([](Project& p) { p.more = affine("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"); }),
       "no rigid transform"}};
  for (const auto& [bytes, what] : kBad) {
    const std::string message = refusal(folder.write("a.inv3", bytes));
    CAPTURE(message);
    CAPTURE(std::string(what));
    CHECK(has(message, what));
    CHECK((is_one_line(message) || message == "no error"));
  }
}

TEST_CASE("the skull of Debian's invesalius-examples is read") {
  const std::filesystem::path skull = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";
  if (!std::filesystem::exists(skull)) {
    MESSAGE("skipped: " << skull.string() << " is not there (apt install invesalius-examples)");
    return;
  }
  const SourceVolume v = read_volume(skull);
  CHECK(v.grid == VoxelGrid{256, 256, 108});
  CHECK(v.min == -1024);
  CHECK(v.max == 2986);
  // Enamel, which is denser than bone, lies below the middle of the bone and in front of it.
  struct Middle {
    Three sum{};
    double count = 0;
  } enamel, bone;
  for (const auto& [i, j, k] : voxels(v.grid)) {
    const float value = v.values[v.grid.index(i, j, k)];
    if (value < 500) continue;
    Middle& of = value > 2200 ? enamel : bone;
    const Three p = position_of(v, i, j, k);
    for (std::size_t axis = 0; axis < 3; ++axis) of.sum[axis] += p[axis];
    ++of.count;
  }
  REQUIRE(enamel.count > 100);
  CHECK(enamel.sum[1] / enamel.count < bone.sum[1] / bone.count - 20);
  CHECK(enamel.sum[2] / enamel.count < bone.sum[2] / bone.count - 20);
}

}  // namespace kerf::invesalius_test
