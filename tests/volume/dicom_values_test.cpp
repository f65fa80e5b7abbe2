// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::dicom_values_test {

using namespace kerf::test;

TEST_CASE("tags that concern the display alone change no value") {
  const std::vector<std::function<void(DicomSpec&)>> changes{
      [](DicomSpec& spec) { spec.set(0x0028, 0x0004, "CS", "MONOCHROME1"); },
      [](DicomSpec& spec) { spec.set(0x2050, 0x0020, "CS", "INVERSE"); },
      [](DicomSpec& spec) {
        spec.set(0x0028, 0x1050, "DS", "40");
        spec.set(0x0028, 0x1051, "DS", "8");
        spec.set(0x0028, 0x3010, "SQ", dicom_item(dicom_element(0x0028, 0x3002, "US", "xxxxxx")));
      },
      [](DicomSpec& spec) {  // 12 bits of 16, an overlay in the others
        spec.set(0x0028, 0x0101, "US", u16(12));
        spec.set(0x0028, 0x0102, "US", u16(11));
        for (auto& value : spec.values) value = static_cast<std::int16_t>(value & 0xfff);
        for (auto& value : spec.values) value = static_cast<std::int16_t>(value | 0x5000);
      },
      [](DicomSpec& spec) {  // the same, stored from bit 4 on
        spec.set(0x0028, 0x0101, "US", u16(12));
        spec.set(0x0028, 0x0102, "US", u16(15));
        for (auto& value : spec.values) value = static_cast<std::int16_t>(value << 4 | 5);
      }};
  for (const auto& change : changes) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int) {
      for (auto& value : spec.values) value = static_cast<std::int16_t>(value - 30);
      spec.intercept = 30;
      change(spec);
    });
    CHECK(same_values(read_volume(folder.path()), counting<float>()));
  }
}

TEST_CASE("padding becomes air, and nothing else does") {
  const auto padded = [](const std::function<void(DicomSpec&)>& change) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int) {
      spec.values[5] = -2000;
      change(spec);
    });
    std::vector<float> values;
    const SourceVolume v = read_volume(folder.path());
    for (std::size_t i = 0; i < 60; ++i) values.push_back(v.values[i]);
    return values;
  };
  const auto expected = [](float slope, float intercept, float air) {
    std::vector<float> values;
    for (int i = 0; i < 60; ++i) {
      values.push_back(i % 12 == 5 ? air : slope * static_cast<float>(i) + intercept);
    }
    return values;
  };
  // In HU: -1000. The number may be written as signed or not: 63536 is -2000.
  CHECK(padded([](DicomSpec& spec) { spec.set(0x0028, 0x0120, "SS", u16(63536)); }) ==
        expected(1, 0, -1000));
  const auto unsigned_cells = [](DicomSpec& spec) {
    spec.set(0x0028, 0x0103, "US", u16(0));
    spec.intercept = -1024;
    spec.set(0x0028, 0x0120, "US", u16(63536));
  };
  CHECK(padded(unsigned_cells) == expected(1, -1024, -1000));
  // Values that are no HU: the lowest other value.
  CHECK(padded([&](DicomSpec& spec) {
          unsigned_cells(spec);
          spec.intercept = 7;
        }) == expected(1, 7, 7));
  CHECK(padded([&](DicomSpec& spec) {
          unsigned_cells(spec);
          spec.set(0x0008, 0x0060, "CS", "MR");
          spec.slope = 0.5;
        }) == expected(0.5, -1024, -1024));
  // A range, either way round.
  for (const auto& range : {std::pair{63000, 63600}, std::pair{63600, 63000}}) {
    CHECK(padded([&](DicomSpec& spec) {
            unsigned_cells(spec);
            spec.set(0x0028, 0x0120, "US", u16(range.first));
            spec.set(0x0028, 0x0121, "US", u16(range.second));
          }) == expected(1, -1024, -1000));
  }
  // 63536 in twelve bits would be 2096: the bits that the file stores have no such number.
  CHECK(padded([&](DicomSpec& spec) {
          unsigned_cells(spec);
          spec.set(0x0028, 0x0101, "US", u16(12));
          spec.set(0x0028, 0x0102, "US", u16(11));
          spec.values[5] = 2096;
        }) == expected(1, -1024, 2096 - 1024));
}

TEST_CASE("a Modality LUT gives the values, clamped at both ends") {
  const auto lut = [](const std::string& descriptor, const std::string& data) {
    return dicom_item(dicom_element(0x0028, 0x3002, "US", descriptor) +
                      dicom_element(0x0028, 0x3004, "LO", "HU") +
                      dicom_element(0x0028, 0x3006, "OW", data));
  };
  std::string wide, narrow;
  for (int i = 0; i < 10; ++i) {
    wide += u16(60000 - 1000 * i);
    narrow += static_cast<char>(200 - 10 * i);
  }
  const auto values = [&](const std::string& item) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int) {
      for (auto& value : spec.values) value = static_cast<std::int16_t>(value - 10);
      spec.set(0x0028, 0x1052, "");
      spec.set(0x0028, 0x1053, "");
      spec.set(0x0028, 0x3000, "SQ", item);
    });
    return read_volume(folder.path());
  };
  const SourceVolume by_words = values(lut(u16(10) + u16(-3) + u16(16), wide));
  const SourceVolume by_bytes = values(lut(u16(10) + u16(-3) + u16(8), narrow));
  for (int i = 0; i < 60; ++i) {
    const auto at = static_cast<float>(std::clamp(i - 10 + 3, 0, 9));
    CHECK(by_words.values[static_cast<std::size_t>(i)] == 60000 - 1000 * at);
    CHECK(by_bytes.values[static_cast<std::size_t>(i)] == 200 - 10 * at);
  }
  CHECK(has(series_message([&](DicomSpec& spec, int) {
              spec.slope = 2;
              spec.set(0x0028, 0x3000, "SQ", lut(u16(10) + u16(0) + u16(16), wide));
            }),
            "has a Modality LUT and a RescaleSlope"));
  CHECK(has(series_message([&](DicomSpec& spec, int) {
              spec.set(0x0028, 0x3000, "SQ", lut(u16(300) + u16(0) + u16(16), wide));
            }),
            "its Modality LUT has 20 bytes for 300 values"));
}

TEST_CASE("cells of any width are read, in the file's byte order") {
  const auto written = [](int bits, bool floats) {
    const TemporaryFolder folder;
    write_dicom_series(folder, [&](DicomSpec& spec, int) {
      std::string bytes;
      for (const std::int16_t value : spec.values) {
        if (floats) {
          bytes += bits == 32 ? bytes_of(static_cast<float>(value))
                              : bytes_of(static_cast<double>(value));
        } else {
          bytes +=
              bits == 8 ? bytes_of(static_cast<std::int8_t>(value)) : bytes_of(std::int32_t{value});
        }
      }
      spec.set(0x0028, 0x0100, "US", u16(bits));
      spec.set(0x0028, 0x0101, "US", u16(bits));
      spec.set(0x0028, 0x0102, "US", u16(bits - 1));
      if (floats) spec.set(0x7fe0, 0x0010, "");
      spec.set(0x7fe0, floats ? (bits == 32 ? 0x0008 : 0x0009) : 0x0010,
               floats ? (bits == 32 ? "OF" : "OD") : "OW", bytes);
    });
    return same_values(read_volume(folder.path()), counting<float>());
  };
  CHECK(written(8, false));
  CHECK(written(32, false));
  CHECK(written(32, true));
  CHECK(written(64, true));
  for (const int bits : {1, 12, 24}) {
    CHECK(has(
        series_message([&](DicomSpec& spec, int) { spec.set(0x0028, 0x0100, "US", u16(bits)); }),
        "bits"));
  }
  CHECK(has(series_message([](DicomSpec& spec, int) { spec.rows = 0; }), "has 3 x 0 pixels"));
  CHECK(has(series_message([](DicomSpec& spec, int) { spec.set(0x7fe0, 0x0010, ""); }),
            "holds no pixels"));
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
    // A decoder of JPEG fills in what is missing before the end.
    std::string bytes = text_of(folder / "slice1");
    const std::size_t end = bytes.rfind("\xff\xd9");
    if (std::string(codec.first).find("JPEG") == std::string::npos) continue;
    REQUIRE(end != std::string::npos);
    folder.write("slice1", bytes.replace(end, 2, std::string(2, '\0')));
    CHECK(has(refusal(folder.path()), "slice1: voxels are missing or broken"));
  }
}

}  // namespace kerf::dicom_values_test
