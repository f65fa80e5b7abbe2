// SPDX-License-Identifier: Apache-2.0
// A series in each of the codecs that scanners and archives write. GDCM writes them from slices
// that are made by hand.
#include <doctest/doctest.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr int kEdge = 16;

/// A value for each voxel with neighbours alike, as codecs expect; some below zero.
std::int16_t value_at(int x, int y, int z) {
  return static_cast<std::int16_t>(40 * x + 3 * y * y - 25 * z - 200);
}

/// A slice, packed by a codec; false where this GDCM has none for it.
bool write_packed(const TempFolder& folder, int z, gdcm::TransferSyntax::TSType syntax) {
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
    const TempFolder folder;
    for (int z = 0; z < 3; ++z) REQUIRE(write_packed(folder, z, codec.second));
    const SourceVolume v = read_volume(folder.path());
    REQUIRE(v.grid == VoxelGrid{kEdge, kEdge, 3});
    CHECK(v.spacing_mm == std::array<double, 3>{0.25, 0.5, 1.5});
    std::size_t wrong = 0;
    for (int z = 0; z < 3; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          wrong += v.values[v.grid.index(x, y, z)] != static_cast<float>(value_at(x, y, z) - 1000);
        }
      }
    }
    CHECK(wrong == 0);
  }
}
