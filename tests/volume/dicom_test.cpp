// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <utility>

#include <doctest/doctest.h>

#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// Slice k of a 3 x 4 x 5 series with the values 12 k .. 12 k + 11, 2 mm apart.
DicomSpec slice(int k) {
  DicomSpec spec;
  spec.instance = k + 1;
  spec.position_mm = {-10, 20, 100.0 + 2 * k};
  for (int i = 0; i < 12; ++i) spec.values.push_back(static_cast<std::int16_t>(12 * k + i));
  return spec;
}

/// Writes five slices, in an order of names that is not their order in space.
void write_series(const TempFolder& folder, const std::function<void(DicomSpec&, int)>& change) {
  for (int k = 0; k < 5; ++k) {
    DicomSpec spec = slice(k);
    change(spec, k);
    folder.write("image" + std::to_string((k * 3) % 5) + ".dcm", dicom(spec));
  }
}

}  // namespace

TEST_CASE("a DICOM series is put together by position, with spacing and rescaling") {
  const TempFolder folder;
  write_series(folder, [](DicomSpec& spec, int) {
    spec.slope = 2;
    spec.intercept = -1000;
  });
  folder.write("notes.txt", "not an image");
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.grid == kSmall);
  CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
  CHECK(v.origin_mm == std::array<double, 3>{-10, 20, 100});
  CHECK(v.direction == std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (std::size_t i = 0; i < 60; ++i) CHECK(v.values[i] == 2.0F * static_cast<float>(i) - 1000.0F);
}

TEST_CASE("a turned DICOM series keeps right-handed axes") {
  const TempFolder folder;
  // Coronal: rows run along +x, columns down along -z, so slices follow +y.
  write_series(folder, [](DicomSpec& spec, int k) {
    spec.orientation = "1\\0\\0\\0\\0\\-1";
    spec.position_mm = {0, 3.0 * k, 50};
  });
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.spacing_mm[2] == doctest::Approx(3.0));
  CHECK(v.direction == std::array<double, 9>{1, 0, 0, 0, 0, 1, 0, -1, 0});
  CHECK(same_values(v, counting<float>()));
}

TEST_CASE("a DICOM folder that is not one even stack is refused in one line") {
  const TempFolder folder;
  const auto refused = [&](const std::string& what) {
    const std::string message = refusal(folder.path());
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(message.find(what) != std::string::npos);
  };
  SUBCASE("no series") {
    refused("no DICOM series");
  }
  SUBCASE("two series") {
    write_series(folder, [](DicomSpec& spec, int k) {
      if (k >= 3) spec.series += ".2";
    });
    refused(
        "2 DICOM series; choose one with ./kerf volume import --series: 1 '' (3 slices of 3 x 4), "
        "2 '' (2 slices");
  }
  SUBCASE("series of one slice each") {
    write_series(folder, [](DicomSpec& spec, int k) { spec.series += std::to_string(k); });
    refused("5 DICOM series");
  }
  SUBCASE("a slice is missing") {
    write_series(folder, [](DicomSpec& spec, int k) {
      if (k == 4) spec.position_mm[2] += 2;
    });
    refused(": 4 mm before slice image2.dcm where 2 mm is usual; add the missing slices");
  }
  SUBCASE("a slice is there twice") {
    write_series(folder, [](DicomSpec&, int) {});
    folder.write("image3 (copy).dcm", dicom(slice(1)));
    refused(": 0 mm before slice image3");
  }
  SUBCASE("two slices in one place") {
    write_series(folder, [](DicomSpec& spec, int) { spec.position_mm[2] = 100; });
    refused("not a voxel size");
  }
  SUBCASE("a tilted gantry") {
    write_series(folder, [](DicomSpec& spec, int k) { spec.position_mm[1] += 0.5 * k; });
    refused("not at right angles");
  }
  SUBCASE("slices of different sizes") {
    write_series(folder, [](DicomSpec& spec, int k) {
      if (k == 2) std::swap(spec.rows, spec.columns);
    });
    refused("differs");
  }
  SUBCASE("no spacing") {
    write_series(folder, [](DicomSpec& spec, int) { spec.pixel_spacing.reset(); });
    refused("spacing is not in the file");
  }
  SUBCASE("one slice") {
    folder.write("only.dcm", dicom(slice(0)));
    refused("one slice");
  }
  SUBCASE("a slice is cut off") {
    write_series(folder, [](DicomSpec&, int) {});
    for (const std::string name : {"image0.dcm", "image3.dcm"}) {
      const std::string whole = read_bytes(folder / name);
      folder.write(name, whole.substr(0, whole.size() - 10));
      refused(name + ": voxels are missing or broken");
      folder.write(name, whole);
    }
  }
}

TEST_CASE("one of several DICOM series is taken by its number or identifier") {
  const TempFolder folder;
  write_series(folder, [](DicomSpec& spec, int k) {
    if (k >= 3) spec.series += ".2";
  });
  ReadOptions options;
  options.series = "1";
  CHECK(read_volume(folder.path(), options).grid == VoxelGrid{3, 4, 3});
  options.series = "2";
  const SourceVolume second = read_volume(folder.path(), options);
  CHECK(second.grid == VoxelGrid{3, 4, 2});
  CHECK(second.values[0] == 36);
  CHECK(second.note == "series 2 of 2, '' (2 slices of 3 x 4)");
  options.series = "125.1.2";
  CHECK(read_volume(folder.path(), options).grid == VoxelGrid{3, 4, 2});
  for (const char* none : {"0", "3", "head"}) {
    options.series = none;
    CHECK(refusal(folder.path(), options).find("is not one of them; choose one") !=
          std::string::npos);
  }
}

TEST_CASE("beside an overview of one slice the series is taken, and told") {
  const TempFolder folder;
  write_series(folder, [](DicomSpec& spec, int k) {
    if (k == 4) spec.series = "1.1";
  });
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.grid == VoxelGrid{3, 4, 4});
  CHECK(v.note.find("of 2, ") != std::string::npos);
}

TEST_CASE("a disc's folders are searched where its own holds only an index") {
  const TempFolder folder;
  for (int k = 0; k < 5; ++k) {
    folder.write("DICOM/P1/S" + std::to_string(k), dicom(slice(k)));
  }
  folder.write("DICOMDIR", "an index");
  CHECK(same_values(read_volume(folder.path()), counting<float>()));
}

TEST_CASE("a spacing that the kind of image does not go by is not in the file") {
  const TempFolder folder;
  const auto spaced_at_the_detector = [&](const std::string& text) {
    write_series(folder, [&](DicomSpec& spec, int) {
      spec.pixel_spacing.reset();
      spec.imager_spacing = text;
    });
    return refusal(folder.path());
  };
  CHECK(spaced_at_the_detector("0.4\\0.4").find("spacing is not in the file") != std::string::npos);
  CHECK(spaced_at_the_detector("1\\1") == "no error");
}

TEST_CASE(
    "a spacing that is no two distances is not in the file, whatever the library makes of it") {
  const std::string nul(1, '\0');
  for (const std::string& text :
       {std::string(""), std::string("0\\0"), std::string("0.3\\0"), std::string("0\\0.3"),
        std::string("nan\\nan"), std::string("inf\\inf"), std::string("1e999\\1"),
        std::string("-0.5\\0.5"), std::string("abc\\def"), std::string("0.5x\\0.5"),
        std::string("0,3\\0,3"), std::string("0x1\\0x1"), std::string("0.3"), std::string("0.3\\"),
        std::string("\\0.3"), std::string("0.3\\0.3\\0.3"), "0.3" + nul + "1\\0.3",
        std::string("0 .3\\0.3")}) {
    const TempFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    const std::string message = refusal(folder.path());
    CAPTURE(text);
    CAPTURE(message);
    CHECK(message.find(": spacing is not in the file; add `spacing_mm = [x, y, z]` to the scene "
                       "or `--spacing x,y,z` (mm)") != std::string::npos);
    ReadOptions options;
    options.spacing_mm = {0.25, 0.5, 2};
    CHECK(read_volume(folder.path(), options).spacing_mm == *options.spacing_mm);
  }
  for (const std::string& text : {std::string("0.5\\0.25"), std::string(" 0.5 \\ 0.25"),
                                  std::string("+5e-1\\2.5E-1"), "0.5\\0.25" + nul}) {
    const TempFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    CAPTURE(text);
    CHECK(read_volume(folder.path()).spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
  }
}

TEST_CASE("slices in one file need a distance that the file tells") {
  const TempFolder folder;
  DicomSpec spec;
  spec.frames = 5;
  spec.values = counting<std::int16_t>();
  const std::string missing = "spacing is not in the file";
  CHECK(refusal(folder.write("none.dcm", dicom(spec))).find(missing) != std::string::npos);
  spec.slice_spacing = "2";  // GDCM does not look there in a plain CT
  CHECK(refusal(folder.write("two.dcm", dicom(spec))).find(missing) != std::string::npos);
  spec.slice_spacing = "1";
  const SourceVolume v = read_volume(folder.write("one.dcm", dicom(spec)));
  CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 1});
  CHECK(same_values(v, counting<float>()));
}
