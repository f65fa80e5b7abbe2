// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "tests/volume/volume_files.hpp"

namespace kerf::nrrd_test {

using namespace kerf::test;

// Each volume is 3 x 4 x 5 numbered voxels: value and position of every one are checked.

namespace {

/// The numbers, packed by `bzip2 -1`.
constexpr unsigned char kBzip2[] = {
    0x42, 0x5a, 0x68, 0x31, 0x31, 0x41, 0x59, 0x26, 0x53, 0x59, 0x54, 0xa9, 0xeb, 0xbb, 0x00, 0x00,
    0x00, 0xf8, 0x00, 0x7f, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xf8, 0x20, 0x00, 0x54, 0x66, 0x80,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x1a, 0x0c, 0x06, 0x80, 0x00, 0x06, 0x80, 0x00, 0x00, 0x00,
    0x07, 0xc3, 0x08, 0x39, 0x04, 0x80, 0xa2, 0xcc, 0x34, 0xe3, 0xd0, 0x45, 0x24, 0xd4, 0x55, 0x65,
    0xd8, 0x65, 0xa6, 0xdc, 0x0b, 0xaf, 0x3f, 0x04, 0x31, 0x47, 0x24, 0xb3, 0x4f, 0x45, 0x35, 0x57,
    0x65, 0xb7, 0x5f, 0x86, 0x39, 0x67, 0xae, 0xdb, 0xf1, 0xcf, 0x5d, 0xf9, 0xe8, 0x7e, 0x08, 0x00,
    0x20, 0x01, 0xf8, 0xbb, 0x92, 0x29, 0xc2, 0x84, 0x82, 0xa5, 0x4f, 0x5d, 0xd8};
const std::string kNumbers = bytes_of(counting<std::int16_t>());
const std::string kSpaced = "endian: little\nspacings: 1 2 3\n";

/// A file of shorts with these lines instead of those of the helper.
std::string shorts(const std::string& lines, const std::string& sizes = "3 4 5",
                   const std::string& encoding = "raw") {
  const auto axes = static_cast<int>(std::ranges::count(sizes, ' ')) + 1;
  return "NRRD0005\ntype: short\ndimension: " + std::to_string(axes) + "\nsizes: " + sizes +
         "\nencoding: " + encoding + "\n" + lines;
}
std::string attached(const std::string& lines, const std::string& sizes = "3 4 5") {
  return shorts("endian: little\n" + lines, sizes) + "\n" + kNumbers;
}
std::string in_space(const std::string& space) {
  return "space: " + space +
         "\nspace origin: (10,20,30)\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n";
}

/// The refusal of `bytes` as a.nrrd; "no error" if it is read.
std::string refusal_of(const std::string& bytes, const std::string& name = "a.nrrd") {
  const TemporaryFolder folder;
  return refusal(folder.write(name, bytes));
}
void check_refusal(const std::string& bytes, const std::string& why) {
  const std::string message = refusal_of(bytes);
  CAPTURE(message);
  CHECK(is_one_line(message));
  CHECK(has(message, why));
}
/// What is wrong with reading `bytes`: its refusal, or the first voxel at the wrong place.
std::string fault_of(const std::string& bytes, const FilePlaces& places = {}) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.nrrd", bytes);
  const std::string message = refusal(path);
  return message == "no error" ? misplaced(read_volume(path), places) : message;
}
std::string note_of(const std::string& bytes) {
  const TemporaryFolder folder;
  return read_volume(folder.write("a.nrrd", bytes)).note;
}

FilePlaces turned(std::array<double, 3> signs) {
  FilePlaces places{{10, 20, 30}};
  for (std::size_t row = 0; row < 3; ++row) {
    places.origin[row] *= signs[row];
    for (auto& step : places.steps) step[row] *= signs[row];
  }
  return places;
}

}  // namespace

TEST_CASE("NRRD: every space that the format names is turned to LPS, axis by axis") {
  const std::vector<std::pair<std::vector<std::string>, std::array<double, 3>>> spaces{
      {{"left-posterior-superior", "LPS", "lps", "Left Posterior Superior"}, {1, 1, 1}},
      {{"right-anterior-superior", "RAS", "rightanteriorsuperior"}, {-1, -1, 1}},
      {{"left-anterior-superior", "LAS"}, {1, -1, 1}},
      {{"scanner-xyz", "3D-right-handed", "3D right handed"}, {1, 1, 1}},
      {{"3D-left-handed", "3Dlefthanded"}, {1, 1, -1}}};
  for (const auto& [names, signs] : spaces) {
    for (const std::string& name : names) {
      CAPTURE(name);
      CHECK(fault_of(attached(in_space(name)), turned(signs)) == "");
    }
    for (const std::string& name : {names[0] + "-time", names[0] + "-TIME"}) {
      CAPTURE(name);
      const std::string frame = "space: " + name +
                                "\nspace origin: (10,20,30,7)\nspace directions: (1,0,0,0) "
                                "(0,2,0,0) (0,0,3,0)";
      CHECK(fault_of(attached(frame + "\n"), turned(signs)) == "");
      CHECK(fault_of(attached(frame + " (0,0,0,0.1)\n", "3 4 5 1"), turned(signs)) == "");
    }
  }
  for (const std::string name : {"RAST", "LAST", "LPST", "scanner-xyzt"}) {
    CHECK(has(refusal_of(attached(in_space(name))), "vectors such as (1,0,0,0)"));
  }
  CHECK(has(note_of(attached(in_space("scanner-xyz"))), "no frame of a patient"));
  CHECK(has(note_of(attached(in_space("3D-left-handed"))), "mirrored"));
  CHECK(note_of(attached(in_space("LPS"))).empty());
  CHECK(has(note_of(attached("space dimension: 3\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n")),
            "space: without a name is no frame of a patient"));
  for (const std::string name : {"left-posterior-inferior", "right-up", "LPI", "time", "x"}) {
    check_refusal(attached(in_space(name)), "space: " + name + " is no space");
  }
}

TEST_CASE("NRRD: a space without directions is read only if no axis has to turn") {
  const std::string spacings = "spacings: 1 2 3\nspace origin: (10,20,30)\n";
  CHECK(fault_of(attached("space: LPS\n" + spacings), turned({1, 1, 1})) == "");
  check_refusal(attached("space: RAS\n" + spacings), "RAS without `space directions`");
  check_refusal(attached("space: 3D-left-handed\n" + spacings), "without `space directions`");
  check_refusal(attached(spacings), "space origin: (10,20,30) without `space`");
  CHECK(fault_of(attached("space dimension: 3\n" + spacings), turned({1, 1, 1})) == "");
  check_refusal(attached("space dimension: 2\n" + spacings), "space dimension: 2 is not 3");
  check_refusal(attached("space dimension: 4\n" + in_space("LPS")), "contradicts `space`");
}

TEST_CASE("NRRD: a pair key:=value is no field, whatever its key, and lines may be long and many") {
  const std::string frame = in_space("LPS");
  for (const std::string pair :
       {"type:=CT", "sizes:=20x16x12", "space:=RAS", "dimension:=7", "encoding:=x", "a b:=c: d",
        "note: of:=two", "data file:=none", "x:=", "spacings:= 9 9 9"}) {
    CAPTURE(pair);
    CHECK(fault_of(attached(frame + pair + "\n"), turned({1, 1, 1})) == "");
    CHECK(fault_of(attached(pair + "\n" + frame), turned({1, 1, 1})) == "");
  }
  CHECK(fault_of(attached(frame + "long:=" + std::string(3 << 20, 'x') + "\n"),
                 turned({1, 1, 1})) == "");
  std::string many;
  for (int i = 0; i < 5000; ++i)
    many += "key" + std::to_string(i) + ":=" + std::to_string(i) + "\n";
  CHECK(fault_of(attached(many + "# " + std::string(5000, '#') + "\n" + frame),
                 turned({1, 1, 1})) == "");
  CHECK(fault_of(attached("SPACE: LPS\nspacedirections: (1, 0, 0) ( 0,2,0 )\t(0,0,3)\n")) == "");
  std::string returns;
  for (const char c : shorts("endian: little\n" + frame) + "\n") {
    returns += c == '\n' ? "\r\n" : std::string(1, c);
  }
  CHECK(fault_of(returns + kNumbers, turned({1, 1, 1})) == "");
  check_refusal(attached("typ: short\n"), "the header's line 'typ: short' is no field");
  check_refusal(attached("no field\n"), "'no field' is no field");
  check_refusal(attached("type: float\n"), "type: short and also float; keep one");
}

TEST_CASE("NRRD: a fourth axis of one layer is left out, first or last, and another is refused") {
  const std::string three = "(1,0,0) (0,2,0) (0,0,3)", frame = "space: LPS\n";
  for (const auto& [sizes, lines] : std::vector<std::pair<std::string, std::string>>{
           {"3 4 5 1",
            frame + "space directions: " + three + " none\nkinds: domain domain domain list"},
           {"3 4 5 1", frame + "space directions: " + three + " none\n#"},
           {"1 3 4 5",
            frame + "space directions: none " + three + "\nkinds: vector space space space"},
           {"3 1 4 5", frame + "space directions: (1,0,0) (nan,nan,nan) (0,2,0) (0,0,3)\n#"},
           {"3 4 5 1", "spacings: 1 2 3 nan\nkinds: domain domain domain time"},
           {"1 3 4 5", "spacings: 7 1 2 3"},
           {"3 4 5 1 1", "spacings: 1 2 3 NaN 8\nunits: \"mm\" \"mm\" \"mm\" \"s\" \"\""}}) {
    CAPTURE(sizes);
    CAPTURE(lines);
    CHECK(fault_of(attached(lines + "\n", sizes)) == "");
  }
  const std::string ones = " 1 1 1 1 1 1 1 1 1 1 1 1 1";
  CHECK(fault_of(attached("spacings: 1 2 3" + ones + "\n", "3 4 5" + ones)) == "");
  check_refusal(attached("kinds: domain domain domain time\n", "3 2 5 2"),
                "2 values per voxel along axis 4 (kind time)");
  check_refusal(attached("kinds: RGB-color domain domain\n"), "3 values per voxel along axis 1");
  check_refusal(attached("space: LPS\nspace directions: none (0,2,0) (0,0,3)\n"),
                "along axis 1 (kind ???, no direction)");
  check_refusal(attached("spacings: 1 1 1 1\n", "3 2 5 2"), "4 axes; ");
  check_refusal(attached("kinds: domain domain list\n", "12 5 1"), "2 axes; ");
  check_refusal(attached("kinds: domain domain\n"), "kinds: domain domain is not 3 kinds");
  check_refusal(attached("space: LPST\nspace directions: (1,0,0,0) (0,2,0,1) (0,0,3,0)\n"),
                "an axis of no direction in space");
}

TEST_CASE("NRRD: voxels as hex, as text, packed in members, behind lines and bytes") {
  const TemporaryFolder folder;
  const auto detached = [&](const std::string& data, const std::string& lines,
                            const std::string& encoding = "raw") {
    folder.write("voxels", data);
    const auto path =
        folder.write("a.nhdr", shorts(kSpaced + "data file: voxels\n" + lines, "3 4 5", encoding));
    const std::string message = refusal(path);
    return message == "no error" ? misplaced(read_volume(path)) : message;
  };
  std::string hex, words, commas;
  for (const char c : kNumbers) {
    constexpr std::string_view kDigits = "0123456789aBcDeF";
    hex += kDigits[static_cast<unsigned char>(c) >> 4];
    hex += kDigits[static_cast<unsigned char>(c) & 15];
  }
  for (int i = 0; i < 60; ++i) {
    words += (i % 2 == 0 ? "+" : " ") + std::to_string(i) + (i % 3 == 0 ? ".0\r\n" : "\t");
    commas += std::to_string(i) + (i % 2 == 0 ? ", " : " , ");
  }
  CHECK(detached(hex, "", "hex") == "");
  CHECK(detached(hex.substr(0, 99) + "\n  " + hex.substr(99) + "\n", "", "HEX") == "");
  CHECK(detached(words, "", "text") == "");
  CHECK(detached(commas, "", "ASCII") == "");
  CHECK(detached("of a table\n3\n" + words, "line skip: 2\n", "txt") == "");
  CHECK(detached("one\ntwo\nxyz" + kNumbers, "line skip: 2\nbyte skip: 3\n") == "");
  CHECK(detached("header" + kNumbers, "byte skip: -1\n") == "");
  CHECK(detached("header" + kNumbers + "end", "byteskip: -4\n") == "");
  CHECK(detached(gzipped(kNumbers.substr(0, 50)) + gzipped(kNumbers.substr(50)), "", "gz") == "");
  CHECK(detached("line\n" + gzipped("xyz" + kNumbers), "line skip: 1\nbyte skip: 3\n", "gzip") ==
        "");
  const std::string packed_tight(std::begin(kBzip2), std::end(kBzip2));
  const std::size_t tight = packed_tight.size();
  CHECK(detached(packed_tight, "", "bzip2") == "");
  CHECK(detached("line\n" + packed_tight, "line skip: 1\n", "BZ2") == "");
  CHECK(has(detached(packed_tight.substr(0, tight - 9), "", "bz2"), "packed voxels are broken"));
  CHECK(has(detached(kNumbers, "", "bz2"), "packed voxels are broken"));
  CHECK(has(detached(packed_tight, "byte skip: 2\n", "bz2"), "118 of 120 bytes"));
  CHECK(has(detached(hex.substr(1), "", "hex"), "119 of 120 bytes"));
  CHECK(has(detached("g" + hex, "", "hex"), "no hex digit"));
  CHECK(has(detached(words + " 60", "", "text"), "more voxels than its header says"));
  CHECK(has(detached("1.5 " + words, "", "text"), "voxel 0: 1.5 is no int16"));
  CHECK(has(detached("40000 " + words, "", "text"), "voxel 0: 40000 is no int16"));
  CHECK(has(detached("1,5 " + words, "", "text"), "voxel 0: 1,5 is no int16"));
  CHECK(has(detached(gzipped(kNumbers), "byte skip: -1\n", "gzip"), "only raw voxels allow"));
  CHECK(has(detached(gzipped(kNumbers).substr(0, 80), "", "gzip"), "cut off"));
  const std::string packed = gzipped(kNumbers);
  CHECK(
      has(detached(packed.substr(0, packed.size() - 1), "", "gzip"), "packed voxels are cut off"));
  CHECK(has(detached(kNumbers, "line skip: 9\n"), "0 of 120 bytes"));
  CHECK(has(detached(kNumbers, "byte skip: 9223372036854775807\n"), "0 of 120 bytes"));
  CHECK(has(detached(kNumbers, "byte skip: -9223372036854775808\n"), "0 of 120 bytes"));
}

TEST_CASE("NRRD: as many bytes again behind raw voxels are a contradiction, fewer are noted") {
  const std::string whole = attached("spacings: 1 2 3\n");
  CHECK(has(note_of(whole + "more"), "4 bytes after the voxels are not read"));
  CHECK(has(note_of(whole + kNumbers.substr(1)), "119 bytes after the voxels are not read"));
  check_refusal(whole + kNumbers, "holds 240 bytes of voxels, and its header says 120; correct");
  check_refusal(whole + kNumbers + kNumbers + "x", "holds 361 bytes of voxels");
  const TemporaryFolder folder;
  folder.write("voxels", "a\nb\n" + kNumbers + kNumbers.substr(3));
  const auto behind_lines = [&](const char* lines) {
    return folder.write("a.nhdr", shorts(kSpaced + "data file: voxels\nline skip: " + lines));
  };
  CHECK(has(read_volume(behind_lines("2\n")).note, "117 bytes after the voxels are not read"));
  CHECK(has(refusal(behind_lines("1\nbyte skip: -1\n")), "no error"));
  CHECK(has(refusal(behind_lines("0\n")), "holds 241 bytes of voxels"));
}

TEST_CASE("NRRD: a header is not its own data file, and an empty file has its line") {
  for (const std::string lines : {"data file: a.nrrd\n", "data file: ./a.nrrd\nbyte skip: -1\n",
                                  "data file: LIST 3\na.nrrd\n"}) {
    check_refusal(attached("spacings: 1 2 3\n" + lines), "names the header itself; leave the line");
  }
  check_refusal("", "a.nrrd: is empty; ");
}

TEST_CASE("NRRD: data files of a list, of a pattern, elsewhere") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  for (std::size_t i = 0; i < 5; ++i) {  // a layer each
    const std::string layer = kNumbers.substr(24 * i, 24);
    folder.write("in/s" + std::to_string(8 + i), layer);
    folder.write("in/t0" + std::to_string(9 - i), layer);
    folder.write("in/skip " + std::to_string(i), std::string(i, 'x') + layer);
    folder.write("in/all", kNumbers);
  }
  const auto read = [&](const std::string& data, const std::string& sizes = "3 4 5") {
    const std::string spacings = sizes == "3 4 5" ? "spacings: 1 2 3\n" : "spacings: 1 2 3 4\n";
    const auto path =
        folder.write("a.nhdr", shorts("endian: little\n" + spacings + "data file: " + data, sizes));
    const std::string message = refusal(path);
    return message == "no error" ? misplaced(read_volume(path)) : message;
  };
  const std::string skips = "0 in/skip 0\n1 in/skip 1\n2 in/skip 2\n3 in/skip 3\n4 in/skip 4\n";
  CHECK(read("in/all") == "");
  CHECK(read((folder / "in/all").string()) == "");
  CHECK(read("in/../in/./all") == "");
  CHECK(read("LIST\nin/s8\nin/s9\nin/s10\nin/s11\nin/s12\n") == "");
  CHECK(read("LIST 2\nin/s8\nin/s9\nin/s10\nin/s11\nin/s12\n\n") == "");
  CHECK(read("LIST 3\nin/all\n") == "");
  CHECK(read("SKIPLIST\n" + skips) == "");
  CHECK(read("in/s%d 8 12 1") == "");
  CHECK(read("in/t%02d 9 5 -1 2") == "");
  CHECK(read("in/s%d 8 12 1 2", "3 4 5 1") == "");
  CHECK(has(read("LIST\nin/s8\nin/s9\n"), "names 2 files, and the sizes are those of 5"));
  CHECK(read("SKIPLIST\n0 in/all\n24 in/all\n48 in/all\n72 in/all\n96 in/all\n") == "");
  CHECK(has(read("LIST\nin/s8\nin/s9\nin/s9\nin/s11\nin/s12\n"),
            "names the same voxels of s9 twice; correct the list"));
  CHECK(has(read("LIST 3\nin/s8\nin/s9\n"), "names 2 files"));
  CHECK(has(read("LIST 0\nin/all\n"), "names 1 files"));
  CHECK(has(read("LIST"), "names 0 files"));
  CHECK(has(read("in/s%d 8 12"), "needs the first number"));
  CHECK(has(read("in/s%d 8 12 0"), "needs the first number"));
  CHECK(has(read("in/s%d 8 12 -1"), "names 0 files"));
  CHECK(has(read("in/s%d 1 1000000000 1"), "names 1000000000 files"));
  CHECK(has(read("in/s%d 9 13 1"), "s13 cannot be read"));
  CHECK(has(read("SKIPLIST\nin/s8\n"), "needs a number of bytes"));
  CHECK(has(read("in"), "in cannot be read"));
}

TEST_CASE("NRRD: lengths in another unit become mm, and a unit that is no length is refused") {
  const auto units = [](const std::string& x, const std::string& y, const std::string& z) {
    return ": \"" + x + "\" \"" + y + "\" \"" + z + "\"\n";
  };
  CHECK(fault_of(attached("spacings: 1000 0.2 3\nunits" + units("um", "cm", "mm"))) == "");
  CHECK(fault_of(attached("spacings: 0.001 2 3e6\nunits" + units("m", "", "nm"))) == "");
  CHECK(fault_of(attached("space: RAS\nspace units" + units("micron", "\u00b5m", "Millimeters") +
                          "space origin: (10000,20000,30)\nspace directions: (1000,0,0) (0,2000,0) "
                          "(0,0,3)\n"),
                 turned({-1, -1, 1})) == "");
  const TemporaryFolder folder;
  CHECK(read_volume(
            folder.write("a.nrrd", attached("spacings: 1 1 2\nunits" + units("inch", "cm", "dm"))))
            .spacing_mm == std::array<double, 3>{25.4, 10, 200});
  check_refusal(attached("spacings: 1 2 3\nunits" + units("mm", "line", "mm")), "is no length");
  check_refusal(attached("spacings: 1 1 1\nunits" + units("mm", "pixel", "mm")),
                "spacing along y is not in the file");
  check_refusal(attached(in_space("LPS") + "space units" + units("px", "px", "px")),
                "is no length");
  check_refusal(attached("spacings: 1 2 0\n"), "1 2 0 mm is not a voxel size");
  check_refusal(attached("spacings: 1 2 3\nunits: mm mm mm\n"), "is not 3 units in quotes");
  check_refusal(attached("spacings: 1 2 3\nunits: \"mm\" \"mm\"\n"), "is not 3 units in quotes");
  check_refusal(attached(in_space("LPS") + "units" + units("um", "um", "um")),
                "write `space units`");
}

TEST_CASE("NRRD: spacings beside directions must agree, to the digits that are written") {
  const std::string oblique =
      "space: LPS\nspace directions: (0.4,0.3,0) (-0.3,0.4,0) (0,0,0.70710678)\n";
  CHECK(refusal_of(attached(oblique + "spacings: 0.5 0.5 0.707\n")) == "no error");
  CHECK(refusal_of(attached(oblique + "spacings: nan nan NaN\n")) == "no error");
  check_refusal(attached(oblique + "spacings: 0.5 0.6 0.7\n"),
                "contradicts `space directions`, which has 0.5 along axis 2");
  for (const std::string other : {"1 1 1", "0.5 0.52 0.7071", "0.5 0.5 0.706", "-0.5 0.5 0.707"}) {
    check_refusal(attached(oblique + "spacings: " + other + "\n"),
                  "contradicts `space directions`");
  }
  check_refusal(attached(oblique + "spacings: 0.5 0.5\n"), "is not 3 numbers");
  const TemporaryFolder folder;
  ReadOptions options;
  options.allow_missing_spacing = true;
  const auto half = folder.write("a.nrrd", attached("spacings: 1 nan 3\n"));
  CHECK(read_volume(half, options).spacing_known == 0b101);
  CHECK(has(refusal(half), "spacing along y is not in the file"));
}

TEST_CASE("NRRD: axis mins is the border of the first voxel, or the centre at a node") {
  const std::string mins = "spacings: 1 2 3\naxis mins: 10 20 30\n";
  FilePlaces cells{{10.5, 21, 31.5}}, mixed{{10, 21, 30}};
  CHECK(fault_of(attached(mins), cells) == "");
  CHECK(fault_of(attached(mins + "centers: cell cell cell\n"), cells) == "");
  CHECK(fault_of(attached(mins + "centerings: node ??? node\n"), mixed) == "");
  CHECK(fault_of(attached("spacings: 1 2 3\naxis mins: nan nan nan\n")) == "");
  // A space origin is the centre of the first voxel always.
  CHECK(fault_of(attached(in_space("LPS") + "centers: cell cell cell\n"), turned({1, 1, 1})) == "");
}

TEST_CASE("NRRD: spacings agree with axis mins and maxs, from border to border or node to node") {
  const auto from_to = [](const std::string& maxs, const std::string& more = "") {
    return attached("spacings: 1 2 3\naxis mins: 10 20 30\naxis maxs: " + maxs + "\n" + more);
  };
  const FilePlaces cells{{10.5, 21, 31.5}}, nodes{{10, 20, 30}};
  const std::string cell = "centers: cell cell cell\n", node = "centers: node node node\n";
  CHECK(fault_of(from_to("13 28 45"), cells) == "");
  CHECK(fault_of(from_to("13 28 45", cell), cells) == "");
  CHECK(fault_of(from_to("13.04 nan 45"), cells) != "");
  CHECK(fault_of(from_to("13.00 nan 45.0"), cells) == "");
  CHECK(fault_of(from_to("12 26 42"), nodes) == "");
  CHECK(fault_of(from_to("12 26 42", node), nodes) == "");
  for (const std::string& other :
       {from_to("12 26 42", cell), from_to("13 28 45", node), from_to("13 28 44"),
        from_to("7 12 15"), from_to("10 20 30"), from_to("13 1e300 45")}) {
    check_refusal(other, "contradicts `axis mins` and `axis maxs`, which are ");
  }
}

TEST_CASE("NRRD: what does not concern position or value changes nothing") {
  CHECK(fault_of(attached("content: a: b\nmin: 5\nold min: -1000\nold max: 3000\nnumber: x\nsample "
                          "units: \"HU\"\nlabels: \"a\" \"b c\" \"\"\nthicknesses: 9 9 9\n"
                          "spacings: 1 2 3\naxis maxs: 1 1 1\n")) == "");
  CHECK(fault_of(attached(in_space("RAS") + "measurement frame: (0,1,0) (1,0,0) (0,0,1)\n"),
                 turned({-1, -1, 1})) == "");
  for (const std::string magic :
       {"NRRD00.01", "NRRD0001", "NRRD0002", "NRRD0003", "NRRD0004", "NRRD0006"}) {
    CHECK(fault_of(magic + attached("spacings: 1 2 3\n").substr(8)) == "");
  }
  check_refusal("NRRD0007" + attached("spacings: 1 2 3\n").substr(8), "no NRRD header");
}

TEST_CASE("NRRD: a number, a word or a field that cannot be is refused by its name") {
  const std::string whole = attached("spacings: 1 2 3\n");
  const auto with = [&](const std::string& was, const std::string& is) {
    std::string bytes = whole;
    return bytes.replace(bytes.find(was), was.size(), is);
  };
  check_refusal(with("1 2 3", "0,5 2 3"), "spacings: 0,5 2 3 has commas in its numbers; write");
  check_refusal(with("1 2 3", "1 2 3mm"), "is not 3 numbers");
  check_refusal(with("1 2 3", "1 inf 3"), "is not 3 numbers");
  check_refusal(with("spacings: 1 2 3", "space: LPS\nspace directions: (0,5,0,0) (0,2,0) (0,0,3)"),
                "is not 3 vectors such as (1,0,0), with decimal points");
  check_refusal(with("spacings: 1 2 3", "space: LPS\nspace directions: (0,0,0) (0,2,0) (0,0,3)"),
                "no direction");
  check_refusal(with("short", "block"), "type: block is not a type of numbers");
  check_refusal(with("little", "middle"), "endian: middle is neither little nor big");
  check_refusal(with("endian: little\n", ""), "endian is neither little nor big");
  check_refusal(with("raw", "zrl"), "encoding: zrl is not one of");
  check_refusal(with("dimension: 3", "dimension: 17"), "dimension: 17 is not a number of axes");
  check_refusal(with("dimension: 3", "dimension: 4"), "sizes: 3 4 5 is not 4 whole numbers");
  check_refusal(with("3 4 5", "3 4 99999999999999999999"), "is not 3 whole numbers");
  check_refusal(with("3 4 5", "3 4 -5"), "is empty");
  check_refusal(with("sizes: 3 4 5\n", ""), "sizes is missing");
}

}  // namespace kerf::nrrd_test
