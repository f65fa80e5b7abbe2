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

namespace kerf::meta_test {

using namespace kerf::test;

// Each volume is 3 x 4 x 5 numbered voxels: value and position of every one are checked.

namespace {

const std::string kNumbered = bytes_of(counting<std::int16_t>());

std::string local(const std::string& lines, const std::string& voxels = kNumbered) {
  return meta("MET_SHORT", lines) + voxels;
}
/// What is wrong with reading `bytes`: its refusal, or the first voxel at the wrong place.
std::string wrong_in(const std::string& bytes, const FilePlaces& places = {}) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.mha", bytes);
  const std::string message = refusal(path);
  if (message != "no error") CHECK(is_one_line(message));
  return message == "no error" ? misplaced(read_volume(path), places) : message;
}

const FilePlaces kMoved{{10, 20, 30}};
/// The first axis of the file along -y, the second along x.
const FilePlaces kQuarter{{10, 20, 30}, {{{0, -1, 0}, {2, 0, 0}, {0, 0, 3}}}};
const std::string kQuarterMatrix = " = 0 -1 0 1 0 0 0 0 1\n";

}  // namespace

TEST_CASE(
    "MetaImage: position and directions have several names, and two that differ are refused") {
  for (const std::string key : {"Offset", "Position", "Origin", "ImagePosition", "ElementOrigin"}) {
    CHECK(wrong_in(local(kElementSpacing + key + " = 10 20 30\n"), kMoved) == "");
  }
  for (const std::string key : {"TransformMatrix", "Rotation", "Orientation", "ElementDirection"}) {
    CHECK(wrong_in(local(kElementSpacing + "Offset = 10 20 30\n" + key + kQuarterMatrix),
                   kQuarter) == "");
  }
  CHECK(wrong_in(local(kElementSpacing + "Offset = 10 20 30\nOrigin = 10.0 2e1 30\n"), kMoved) ==
        "");
  CHECK(has(wrong_in(local(kElementSpacing + "Offset = 10 20 30\nOrigin = 0 0 0\n")),
            "Origin: 0 0 0 contradicts `Offset`"));
  CHECK(has(wrong_in(local(kElementSpacing + "Offset = 10 20 30\nOffset = 1 2 3\n")),
            "Offset: 10 20 30 and also 1 2 3"));
  CHECK(wrong_in(local(kElementSpacing + "Comment = a\nComment = b = c\nno field\n\n")) == "");
  CHECK(has(wrong_in(local(kElementSpacing + "Rotation = 1 0 0 0 1 0 0 0 1\nTransformMatrix" +
                           kQuarterMatrix)),
            "contradicts `TransformMatrix`"));
}

TEST_CASE("MetaImage: an anatomical orientation that fits the matrix in no meaning is refused") {
  const std::string key = "AnatomicalOrientation = ";
  for (const std::string letters : {"RAI", "rai", "LPS", "???", "R?I"}) {  // ITK's, MetaIO's page
    CAPTURE(letters);
    CHECK(wrong_in(local(kElementSpacing + key + letters + "\n")) == "");
  }
  const FilePlaces mirrored{{0, 0, 0}, {{{-1, 0, 0}, {0, -2, 0}, {0, 0, 3}}}};
  const std::string matrix = "TransformMatrix = -1 0 0 0 -1 0 0 0 1\n";
  CHECK(wrong_in(local(kElementSpacing + matrix + key + "LPI\n"), mirrored) == "");
  CHECK(wrong_in(local(kElementSpacing + matrix + key + "RAS\n"), mirrored) == "");
  for (const std::string letters : {"RAI", "LPS", "ARI", "RPI"}) {
    CHECK(has(wrong_in(local(kElementSpacing + matrix + key + letters + "\n")),
              letters + " contradicts `TransformMatrix`"));
  }
  CHECK(has(wrong_in(local(kElementSpacing + key + "RAS\n")), "RAS without a `TransformMatrix`"));
  CHECK(has(wrong_in(local(kElementSpacing + key + "XYZ\n")), "is not three of R L A P I S"));
}

TEST_CASE("MetaImage: decimal commas, and other texts that are no numbers, are one clear line") {
  CHECK(has(wrong_in(local("ElementSpacing = 0,5 0,5 0,7\n")),
            "ElementSpacing: 0,5 0,5 0,7 has commas in its numbers; write decimal points"));
  CHECK(has(wrong_in(local(kElementSpacing + "Offset = 1,5 2 3\n")), "has commas"));
  CHECK(has(wrong_in(local("ElementSpacing = 1 2\n")), "is not 3 numbers"));
  CHECK(has(wrong_in(local("ElementSpacing = 1 2 x\n")), "is not 3 numbers"));
  CHECK(has(wrong_in(local("")), "spacing is not in the file"));
  CHECK(has(wrong_in(local("ElementSpacing = 1 nan 3\n")), "mm is not a voxel size"));
  CHECK(
      has(wrong_in(local(kElementSpacing + "CompressedData = maybe\n")), "neither True nor False"));
  CHECK(has(wrong_in("ObjectType = Tube\n" + local(kElementSpacing).substr(19)), "is not Image"));
}

TEST_CASE("MetaImage: the size of an element is its spacing only if that is missing") {
  CHECK(wrong_in(local("ElementSize = 1 2 3\n")) == "");
  CHECK(wrong_in(local("ElementSize = 9 9 9\n" + kElementSpacing)) == "");
  CHECK(wrong_in(local("ElementSpacing = 0.1 0.2 0.3\nOffset = 1 2 3\nDistanceUnits = cm\n"),
                 kMoved) == "");
  CHECK(wrong_in(local("ElementSpacing = 1000 2000 3000\nDistanceUnits = um\n")) == "");
  CHECK(wrong_in(local("DistanceUnits = ?\n" + kElementSpacing)) == "");
  CHECK(has(wrong_in(local("DistanceUnits = px\n" + kElementSpacing)), "is no length"));
}

TEST_CASE("MetaImage: what a reader may apply or not is refused unless it changes nothing") {
  const std::string slope = "ElementToIntensityFunctionSlope = ";
  const std::string offset = "ElementToIntensityFunctionOffset = ";
  CHECK(wrong_in(local(kElementSpacing + slope + "1\n" + offset +
                       "0.0\nElementMin = 5\nElementMax = "
                       "7\nElementNumberOfChannels = 1\n"
                       "CenterOfRotation = 4 5 6\n")) == "");
  CHECK(has(wrong_in(local(kElementSpacing + slope + "2\n")), "may be applied already or not"));
  CHECK(
      has(wrong_in(local(kElementSpacing + offset + "-1024\n")), "may be applied already or not"));
  CHECK(has(wrong_in(local(kElementSpacing + "ElementNumberOfChannels = 2\n")),
            "2 values per voxel"));
  CHECK(
      has(wrong_in(local(kElementSpacing + "CenterOfRotation = 4 5 6\nRotation" + kQuarterMatrix)),
          "CenterOfRotation: 4 5 6 moves the volume"));
}

TEST_CASE("MetaImage: a fourth axis of one layer is left out, and another is refused") {
  const auto four = [](const std::string& sizes, const std::string& lines) {
    return "NDims = 4\nDimSize = " + sizes + "\nElementType = MET_SHORT\n" + lines +
           "ElementDataFile = LOCAL\n" + kNumbered;
  };
  const std::string turn = "TransformMatrix = 0 -1 0 0 1 0 0 0 0 0 1 0 0 0 0 1\n";
  const std::string spacing = "ElementSpacing = 1 2 3 9\n", offset = "Offset = 10 20 30 40\n";
  CHECK(wrong_in(four("3 4 5 1", spacing + offset + turn), kQuarter) == "");
  CHECK(wrong_in(four("1 3 4 5", "ElementSpacing = 9 1 2 3\nOffset = 40 10 20 30\n"), kMoved) ==
        "");
  CHECK(has(wrong_in(four("3 2 5 2", spacing)), "4 axes; "));
  CHECK(has(wrong_in(four("3 4 5", spacing)), "DimSize: 3 4 5 is not 4 whole numbers"));
  CHECK(has(
      wrong_in(four("3 4 5 1", spacing + "TransformMatrix = 1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1\n")),
      "turns an axis out of space"));
}

TEST_CASE("MetaImage: byte order, headers before the voxels, text, and voxels in several files") {
  const std::string big = bytes_of(counting<std::int16_t>(), std::endian::big);
  for (const std::string key : {"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}) {
    CHECK(wrong_in(local(kElementSpacing + key + " = True\n", big)) == "");
    CHECK(wrong_in(local(kElementSpacing + key + " = False\n")) == "");
  }
  CHECK(has(wrong_in(local(kElementSpacing +
                           "ElementByteOrderMSB = True\nBinaryDataByteOrderMSB = False\n")),
            "ElementByteOrderMSB: True contradicts"));
  CHECK(wrong_in(local(kElementSpacing + "HeaderSize = -1\n", "junk" + kNumbered)) == "");
  for (const std::string size : {"10", "-2"}) {
    CHECK(has(wrong_in(local(kElementSpacing + "HeaderSize = " + size + "\n")),
              "HeaderSize: " + size + " is not the number of bytes before the voxels"));
  }
  std::string words;
  for (int i = 0; i < 60; ++i) words += std::to_string(i) + "\n";
  CHECK(wrong_in(local(kElementSpacing + "BinaryData = False\n", words)) == "");

  const TemporaryFolder folder;
  std::string list;
  for (std::size_t i = 0; i < 5; ++i) {  // a layer each
    const std::string layer = kNumbered.substr(24 * i, 24), name = std::to_string(1 + 2 * i);
    folder.write("s 0" + name, layer);
    folder.write("t" + std::to_string(i + 1), "header" + layer);
    folder.write("z" + std::to_string(i + 1), gzipped(layer));
    list += "\ns 0" + name;
  }
  const auto read = [&](const std::string& data, const std::string& lines = "") {
    const auto path = folder.write("a.mhd", meta("MET_SHORT", kElementSpacing + lines, data));
    const std::string message = refusal(path);
    return message == "no error" ? misplaced(read_volume(path)) : message;
  };
  CHECK(read("LIST" + list) == "");
  CHECK(read("LIST 2" + list) == "");
  CHECK(read("s %02d 1 9 2") == "");
  CHECK(read("t%d", "HeaderSize = 6\n") == "");
  CHECK(read("t%d 1", "HeaderSize = -1\n") == "");
  CHECK(read("z%d 1 5 1", "CompressedData = True\n") == "");
  CHECK(has(read("LIST" + list.substr(0, list.size() - 5)), "names 4 files, and the sizes"));
  CHECK(has(read("LIST\na\nb\nnowhere\nd\ne"), "data file a cannot be read"));
  CHECK(has(read("t%d 1 4 1"), "names 4 files, and the sizes are those of 5"));
  CHECK(has(read("t%d 2"), "data file t6 cannot be read"));
  CHECK(has(read("s 01"), "24 of 120 bytes"));
}

TEST_CASE_TEMPLATE("MetaImage: every type of numbers keeps its values", T, std::int8_t,
                   std::uint8_t, std::int16_t, std::uint16_t, std::int32_t, std::uint32_t,
                   std::int64_t, std::uint64_t, float, double) {
  const std::string type = std::is_same_v<T, float>    ? "FLOAT"
                           : std::is_same_v<T, double> ? "DOUBLE"
                           : sizeof(T) == 1            ? "CHAR"
                           : sizeof(T) == 2            ? "SHORT"
                           : sizeof(T) == 4            ? "LONG"  // 4 bytes wherever it is read
                                                       : "LONG_LONG";
  const std::string sign = std::is_floating_point_v<T> || std::is_signed_v<T> ? "" : "U";
  CHECK(wrong_in(meta("MET_" + sign + type, kElementSpacing) + bytes_of(counting<T>())) == "");
}

TEST_CASE("MetaImage: an empty file, a missing field, a header as data and twice the bytes") {
  const TemporaryFolder folder;
  CHECK(has(refusal(folder.write("a.mha", "")), "a.mha: is empty; "));
  CHECK(has(wrong_in("DimSize = 3 4 5\nElementDataFile = LOCAL\n"),
            "a.mha: NDims is missing; correct the header"));
  for (const std::string name : {"a.mha", "./a.mha", "LIST 3\na.mha"}) {
    CHECK(has(wrong_in(meta("MET_SHORT", kElementSpacing, name)),
              "names the header itself; write LOCAL"));
  }
  CHECK(has(wrong_in(meta("MET_LONG", kElementSpacing) + bytes_of(counting<std::int64_t>())),
            "holds 480 bytes of voxels, and its header says 240; correct the sizes or the type"));
}

TEST_CASE("MetaImage: an origin beyond 1 km is refused, and one at it is not") {
  CHECK(wrong_in(local(kElementSpacing + "Offset = 1e6 -1e6 0\n"), {{1e6, -1e6, 0}}) == "");
  for (const std::string far : {"1000001", "-1e30", "1e300"}) {
    CHECK(has(wrong_in(local(kElementSpacing + "Offset = 0 0 " + far + "\n")),
              "its origin is farther than 1 km; correct the header"));
  }
}

}  // namespace kerf::meta_test
