// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iostream>
#include <sstream>

#include <doctest/doctest.h>

#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Three = std::array<double, 3>;

void check_counting(const SourceVolume& v) {
  CHECK(v.grid == kSmall);
  CHECK(same_values(v, counting<float>()));
  CHECK(v.min == 0.0);
  CHECK(v.max == 59.0);
  CHECK(v.spacing_mm == Three{1, 2, 3});
  CHECK(v.has_spacing);
}

/// Where voxel (i, j, k) lies in the frame of the file.
Three place(const SourceVolume& v, double i, double j, double k) {
  Three p = v.origin_mm;
  const Three step{i * v.spacing_mm[0], j * v.spacing_mm[1], k * v.spacing_mm[2]};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) p[r] += v.direction[3 * r + c] * step[c];
  }
  return p;
}

double determinant(const std::array<double, 9>& d) {
  return d[0] * (d[4] * d[8] - d[5] * d[7]) - d[1] * (d[3] * d[8] - d[5] * d[6]) +
         d[2] * (d[3] * d[7] - d[4] * d[6]);
}

}  // namespace

TEST_CASE("NRRD is read attached and detached, in both byte orders, raw, gzip and text") {
  const TempFolder folder;
  const std::string little = "endian: little\n" + kSpacings;
  const std::string big = "endian: big\n" + kSpacings;
  const auto u16 = bytes_of(counting<std::uint16_t>());
  const auto u16_big = bytes_of(counting<std::uint16_t>(), std::endian::big);

  check_counting(read_volume(folder.write("a.nrrd", nrrd("ushort", little) + "\n" + u16)));
  check_counting(read_volume(folder.write("b.nrrd", nrrd("ushort", big) + "\n" + u16_big)));
  check_counting(
      read_volume(folder.write("c.nrrd", nrrd("ushort", little, "gzip") + "\n" + gzipped(u16))));

  folder.write("voxels.bin", u16_big);
  check_counting(
      read_volume(folder.write("d.nhdr", nrrd("ushort", big + "data file: voxels.bin\n"))));
  folder.write("voxels.gz", gzipped(u16));
  check_counting(read_volume(
      folder.write("e.nhdr", nrrd("ushort", little + "data file: voxels.gz\n", "gzip"))));

  std::ostringstream words;
  for (const int value : counting<int>()) words << value << '\n';
  check_counting(
      read_volume(folder.write("f.nrrd", nrrd("short", kSpacings, "ascii") + "\n" + words.str())));
}

TEST_CASE_TEMPLATE("NRRD voxels of every integer and floating type keep their values", T,
                   std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                   std::uint32_t, std::int64_t, std::uint64_t, float, double) {
  const char* type = std::is_same_v<T, float>    ? "float"
                     : std::is_same_v<T, double> ? "double"
                     : sizeof(T) == 1            ? (std::is_signed_v<T> ? "int8" : "uint8")
                     : sizeof(T) == 2            ? (std::is_signed_v<T> ? "int16" : "uint16")
                     : sizeof(T) == 4            ? (std::is_signed_v<T> ? "int32" : "uint32")
                                                 : (std::is_signed_v<T> ? "int64" : "uint64");
  std::vector<T> values = counting<T>();
  values[0] = static_cast<T>(std::is_signed_v<T> ? -100 : 100);
  const TempFolder folder;
  const auto path =
      folder.write("a.nrrd", nrrd(type, "endian: little\n" + kSpacings) + "\n" + bytes_of(values));
  const SourceVolume v = read_volume(path);
  CHECK(v.values[0] == (std::is_signed_v<T> ? -100.0F : 100.0F));
  CHECK(v.values[59] == 59.0F);
}

TEST_CASE("MetaImage is read attached and detached, in both byte orders") {
  const TempFolder folder;
  const auto u16 = bytes_of(counting<std::uint16_t>());
  const auto u16_big = bytes_of(counting<std::uint16_t>(), std::endian::big);
  check_counting(read_volume(folder.write("a.mha", meta("MET_USHORT", kElementSpacing) + u16)));
  check_counting(read_volume(folder.write(
      "b.mha", meta("MET_USHORT", "ElementByteOrderMSB = True\n" + kElementSpacing) + u16_big)));
  folder.write("voxels.raw", u16);
  check_counting(
      read_volume(folder.write("c.mhd", meta("MET_USHORT", kElementSpacing, "voxels.raw"))));
}

TEST_CASE("NIfTI is read plain and gzipped, in both byte orders, with one layer of time") {
  const TempFolder folder;
  NiftiSpec spec;
  const auto f32 = bytes_of(counting<float>());
  check_counting(read_volume(folder.write("a.nii", nifti(spec) + f32)));
  check_counting(read_volume(folder.write("b.nii.gz", gzipped(nifti(spec) + f32))));
  spec.dim = {3, 4, 5, 1};
  check_counting(read_volume(folder.write("c.nii", nifti(spec) + f32)));
  spec.order = std::endian::big;
  spec.datatype = 4;  // int16
  spec.bits = 16;
  check_counting(read_volume(
      folder.write("d.nii", nifti(spec) + bytes_of(counting<std::int16_t>(), std::endian::big))));
}

TEST_CASE("the spacing of the options goes before the file's") {
  const TempFolder folder;
  const auto bytes = bytes_of(counting<std::uint8_t>());
  ReadOptions options;
  options.spacing_mm = Three{0.5, 0.25, 0.125};
  const auto with = folder.write("a.nrrd", nrrd("uint8", kSpacings) + "\n" + bytes);
  CHECK(read_volume(with, options).spacing_mm == *options.spacing_mm);
  const auto without = folder.write("b.nrrd", nrrd("uint8", "") + "\n" + bytes);
  const SourceVolume v = read_volume(without, options);
  CHECK(v.spacing_mm == *options.spacing_mm);
  CHECK(v.has_spacing);
}

TEST_CASE("a first look may go without spacing, and is told so") {
  const TempFolder folder;
  ReadOptions options;
  options.allow_missing_spacing = true;
  const auto path =
      folder.write("a.nrrd", nrrd("uint8", "") + "\n" + bytes_of(counting<std::uint8_t>()));
  CHECK_FALSE(read_volume(path, options).has_spacing);
}

TEST_CASE("position and direction of a file are kept") {
  const TempFolder folder;
  // A quarter turn about z: the first axis points along +y, the second along -x.
  const auto path = folder.write(
      "a.nrrd",
      nrrd("uint8",
           "space: left-posterior-superior\n"
           "space directions: (0,0.5,0) (-0.25,0,0) (0,0,2)\nspace origin: (10,20,30)\n") +
          "\n" + bytes_of(counting<std::uint8_t>()));
  const SourceVolume v = read_volume(path);
  CHECK(v.spacing_mm == Three{0.5, 0.25, 2});
  CHECK(place(v, 0, 0, 0) == Three{10, 20, 30});
  CHECK(place(v, 2, 0, 0) == Three{10, 21, 30});
  CHECK(place(v, 0, 1, 0) == Three{9.75, 20, 30});
  CHECK(determinant(v.direction) == doctest::Approx(1.0));
}

TEST_CASE("a left-handed file becomes right-handed and every value stays in its place") {
  const TempFolder folder;
  const std::string frame =
      "space: left-posterior-superior\nspace origin: (10,20,30)\nspace directions: ";
  const auto bytes = bytes_of(counting<std::uint8_t>());
  const auto path =
      folder.write("a.nrrd", nrrd("uint8", frame + "(1,0,0) (0,2,0) (0,0,-3)\n") + "\n" + bytes);
  const SourceVolume v = read_volume(path);
  CHECK(determinant(v.direction) == doctest::Approx(1.0));
  for (std::int32_t k = 0; k < kSmall.nz; ++k) {
    for (std::int32_t j = 0; j < kSmall.ny; ++j) {
      for (std::int32_t i = 0; i < kSmall.nx; ++i) {
        const Three p = place(v, i, j, k);
        // In the file voxel (a, b, c) lies at (10 + a, 20 + 2b, 30 - 3c) and holds its own index.
        const auto a = static_cast<std::int32_t>(std::lround(p[0] - 10));
        const auto b = static_cast<std::int32_t>(std::lround((p[1] - 20) / 2));
        const auto c = static_cast<std::int32_t>(std::lround((30 - p[2]) / 3));
        REQUIRE(kSmall.contains({a, b, c}));
        CHECK(v.values[kSmall.index(i, j, k)] == static_cast<float>(kSmall.index(a, b, c)));
      }
    }
  }
}

TEST_CASE("reading prints nothing, whatever the library has to say") {
  const TempFolder folder;
  const auto cut = folder.write("a.mha", meta("MET_USHORT", kElementSpacing) + "too few");
  const std::ostringstream printed;
  std::streambuf* const before = std::cerr.rdbuf(printed.rdbuf());
  const std::string message = refusal(cut);
  std::cerr.rdbuf(before);
  CHECK(message != "no error");
  CHECK(printed.str().empty());
}
