// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <utility>

#include <doctest/doctest.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include "tests/support/voxels.hpp"
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
void write_series(const TemporaryFolder& folder,
                  const std::function<void(DicomSpec&, int)>& change) {
  for (int k = 0; k < 5; ++k) {
    DicomSpec spec = slice(k);
    change(spec, k);
    folder.write("image" + std::to_string((k * 3) % 5) + ".dcm", dicom(spec));
  }
}

}  // namespace

TEST_CASE("a DICOM series is put together by position, with spacing and rescaling") {
  const TemporaryFolder folder;
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
  const TemporaryFolder folder;
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
  using Change = std::function<void(DicomSpec&, int)>;
  const std::pair<Change, std::string> cases[] = {
      {[](DicomSpec& spec, int k) { spec.series += k >= 3 ? ".2" : ""; },
       "2 DICOM series; choose one with ./kerf volume import --series: 1 '' (3 slices of 3 x 4), 2 "
       "'' (2 slices"},
      {[](DicomSpec& spec, int k) { spec.series += std::to_string(k); }, "5 DICOM series"},
      {[](DicomSpec& spec, int k) { spec.position_mm[2] += k == 4 ? 2 : 0; },
       ": 4 mm before slice image2.dcm where 2 mm is usual; add the missing slices"},
      {[](DicomSpec& spec, int) { spec.position_mm[2] = 100; }, "not a voxel size"},
      {[](DicomSpec& spec, int k) { spec.position_mm[1] += 0.5 * k; },
       "not at right angles"},  // a tilted gantry
      {[](DicomSpec& spec, int k) {
         if (k == 2) std::swap(spec.rows, spec.columns);
       },
       "differs"},
      {[](DicomSpec& spec, int) { spec.pixel_spacing.reset(); }, "spacing is not in the file"}};
  for (const auto& [change, why] : cases) {
    const TemporaryFolder folder;
    write_series(folder, change);
    const std::string message = refusal(folder.path());
    CAPTURE(message);
    CHECK(is_one_line(message));
    CHECK(has(message, why));
  }
  const TemporaryFolder none, one, whole;
  CHECK(has(refusal(none.path()), "no DICOM series"));
  one.write("only.dcm", dicom(slice(0)));
  CHECK(has(refusal(one.path()), "one slice"));
  write_series(whole, [](DicomSpec&, int) {});
  for (const std::string name : {"image0.dcm", "image3.dcm"}) {
    const std::string bytes = text_of(whole / name);
    whole.write(name, bytes.substr(0, bytes.size() - 10));
    CHECK(has(refusal(whole.path()), name + ": voxels are missing or broken"));
    whole.write(name, bytes);
  }
  whole.write("image3 (copy).dcm", dicom(slice(1)));
  CHECK(has(refusal(whole.path()), ": 0 mm before slice image3"));
}

TEST_CASE("one of several DICOM series is taken by its number or identifier") {
  const TemporaryFolder folder;
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
  CHECK(second.note == "series 2 of 2, '' (2 slices of 3 x 4) (import --series chooses another)");
  options.series = "125.1.2";
  CHECK(read_volume(folder.path(), options).grid == VoxelGrid{3, 4, 2});
  for (const char* none : {"0", "3", "head"}) {
    options.series = none;
    CHECK(refusal(folder.path(), options).find("is not one of them; choose one") !=
          std::string::npos);
  }
}

TEST_CASE("beside an overview of one slice the series is taken, and told") {
  const TemporaryFolder folder;
  write_series(folder, [](DicomSpec& spec, int k) {
    if (k == 4) spec.series = "1.1";
  });
  const SourceVolume v = read_volume(folder.path());
  CHECK(v.grid == VoxelGrid{3, 4, 4});
  CHECK(has(v.note, "of 2, "));
}

TEST_CASE("a disc's folders are searched where its own holds only an index") {
  const TemporaryFolder folder;
  for (int k = 0; k < 5; ++k) {
    folder.write("DICOM/P1/S" + std::to_string(k), dicom(slice(k)));
  }
  folder.write("DICOMDIR", "an index");
  CHECK(same_values(read_volume(folder.path()), counting<float>()));
}

TEST_CASE("a spacing that the kind of image does not go by is not in the file") {
  const TemporaryFolder folder;
  const auto spaced_at_the_detector = [&](const std::string& text) {
    write_series(folder, [&](DicomSpec& spec, int) {
      spec.pixel_spacing.reset();
      spec.imager_spacing = text;
    });
    return refusal(folder.path());
  };
  CHECK(has(spaced_at_the_detector("0.4\\0.4"), "spacing is not in the file"));
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
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    const std::string message = refusal(folder.path());
    CAPTURE(text);
    CAPTURE(message);
    CHECK(has(message,
              ": spacing is not in the file; add `spacing_mm = [x, y, z]` to the scene "
              "or `--spacing x,y,z` (mm)"));
    ReadOptions options;
    options.spacing_mm = {0.25, 0.5, 2};
    CHECK(read_volume(folder.path(), options).spacing_mm == *options.spacing_mm);
  }
  for (const std::string& text : {std::string("0.5\\0.25"), std::string(" 0.5 \\ 0.25"),
                                  std::string("+5e-1\\2.5E-1"), "0.5\\0.25" + nul}) {
    const TemporaryFolder folder;
    write_series(folder, [&](DicomSpec& spec, int) { spec.pixel_spacing = text; });
    CAPTURE(text);
    CHECK(read_volume(folder.path()).spacing_mm == std::array<double, 3>{0.25, 0.5, 2});
  }
}

TEST_CASE("slices in one file need a distance that the file tells") {
  const TemporaryFolder folder;
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

// A series in each of the codecs that scanners and archives write. GDCM writes them from slices
// that are made by hand.

namespace {

constexpr int kEdge = 16;

/// A value for each voxel with neighbours alike, as codecs expect; some below zero.
std::int16_t value_at(int x, int y, int z) {
  return static_cast<std::int16_t>(40 * x + 3 * y * y - 25 * z - 200);
}

/// A slice, packed by a codec; false where this GDCM has none for it.
bool write_packed(const TemporaryFolder& folder, int z, gdcm::TransferSyntax::TSType syntax) {
  DicomSpec spec;
  spec.rows = spec.columns = kEdge;
  spec.instance = z + 1;
  spec.position_mm = {0, 0, 1.5 * z};
  spec.intercept = -1000;
  for (int y = 0; y < kEdge; ++y) {
    for (int x = 0; x < kEdge; ++x) spec.values.push_back(value_at(x, y, z));
  }
  const std::string name = "slice" + std::to_string(z);  // scanners write no ending
  const std::filesystem::path path = folder.write(name, dicom(spec));
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  if (!reader.Read()) return false;
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(syntax);
  change.SetInput(reader.GetImage());
  if (!change.Change()) return false;
  gdcm::ImageWriter writer;
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  writer.SetFileName(path.c_str());
  return writer.Write();
}

}  // namespace

TEST_CASE("a DICOM series reads the same from every codec without loss") {
  using Syntax = gdcm::TransferSyntax;
  const std::pair<const char*, Syntax::TSType> kCodecs[] = {
      {"explicit little-endian", Syntax::ExplicitVRLittleEndian},
      {"implicit little-endian", Syntax::ImplicitVRLittleEndian},
      {"explicit big-endian", Syntax::ExplicitVRBigEndian},
      {"deflated", Syntax::DeflatedExplicitVRLittleEndian},
      {"RLE", Syntax::RLELossless},
      {"JPEG lossless", Syntax::JPEGLosslessProcess14_1},
      {"JPEG-LS", Syntax::JPEGLSLossless},
      {"JPEG 2000", Syntax::JPEG2000Lossless}};
  for (const auto& codec : kCodecs) {
    CAPTURE(std::string(codec.first));
    const TemporaryFolder folder;
    for (int z = 0; z < 3; ++z) REQUIRE(write_packed(folder, z, codec.second));
    const SourceVolume v = read_volume(folder.path());
    REQUIRE(v.grid == VoxelGrid{kEdge, kEdge, 3});
    CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 1.5});
    std::size_t wrong = 0;
    for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {kEdge, kEdge, 3}})) {
      wrong += v.values[v.grid.index(x, y, z)] != static_cast<float>(value_at(x, y, z) - 1000);
    }
    CHECK(wrong == 0);
  }
}
