// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

/// Small volume files written by hand, byte by byte, so that the readers are checked against the
/// formats' descriptions and not against another writer of the same library.
namespace kerf::test {

[[nodiscard]] std::string gzipped(const std::string& bytes);

/// The bytes of one number in either byte order.
template <class T>
std::string bytes_of(T value, std::endian order = std::endian::little) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (order == std::endian::big) std::reverse(raw.begin(), raw.end());
  return {raw.data(), raw.size()};
}
template <class T>
std::string bytes_of(const std::vector<T>& values, std::endian order = std::endian::little) {
  std::string bytes;
  for (const T value : values) bytes += bytes_of(value, order);
  return bytes;
}

/// 3 x 4 x 5 voxels with the values 0, 1, 2 .. 59.
inline constexpr VoxelGrid kSmall{3, 4, 5};
template <class T>
std::vector<T> counting(std::size_t count = 60) {
  std::vector<T> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<T>(i));
  return values;
}

/// A NRRD header of 3 x 4 x 5 voxels without spacing; `more` adds whole lines.
[[nodiscard]] std::string nrrd(const std::string& type, const std::string& more,
                               const std::string& encoding = "raw",
                               const std::string& sizes = "3 4 5");
inline const std::string kSpacings = "spacings: 1 2 3\n";

/// A MetaImage header of 3 x 4 x 5 voxels; `more` adds whole lines before `ElementDataFile`.
[[nodiscard]] std::string meta(const std::string& type, const std::string& more,
                               const std::string& data_file = "LOCAL");
inline const std::string kElementSpacing = "ElementSpacing = 1 2 3\n";

struct NiftiSpec {
  std::vector<std::int16_t> dim{3, 4, 5};
  std::array<float, 3> pixdim{1, 2, 3};
  bool sform = true;                      ///< of pixdim, along the axes of LPS
  std::int16_t datatype = 16, bits = 32;  ///< float32
  std::endian order = std::endian::little;
};
/// A NIfTI-1 header for a single file, with the 4 bytes that end it.
[[nodiscard]] std::string nifti(const NiftiSpec& spec);

/// A DICOM element in explicit little endian; of type SQ its value is items.
[[nodiscard]] std::string dicom_element(std::uint16_t group, std::uint16_t number,
                                        const std::string& type, std::string value);
[[nodiscard]] std::string dicom_item(const std::string& elements);
/// A page of a TIFF, as one strip that is not packed: grey values of `bits`.
struct TiffPage {
  std::string pixels;
  std::uint32_t width = 3, height = 4;
  std::uint16_t bits = 8;
  /// Further fields, or others in place of the usual ones: shorts, longs, a text, or pairs of
  /// longs.
  std::map<std::uint16_t, std::vector<std::uint16_t>> shorts{};
  std::map<std::uint16_t, std::vector<std::uint32_t>> longs{}, ratios{};
  std::string description{};
};
[[nodiscard]] std::string tiff(const std::vector<TiffPage>& pages,
                               std::endian order = std::endian::little);

/// The layer z of 3 x 4 x 5 voxels that count 0 .. 59.
template <class T>
std::string slice(int z, std::endian order = std::endian::little) {
  const std::vector<T> all = counting<T>();
  return bytes_of(std::vector<T>(all.begin() + 12 * z, all.begin() + 12 * (z + 1)), order);
}

struct DicomSpec {
  int rows = 4, columns = 3;
  std::array<double, 3> position_mm{0, 0, 0};
  std::string orientation = "1\\0\\0\\0\\1\\0";
  std::optional<std::string> pixel_spacing = "0.5\\0.25";  ///< between rows, between columns
  std::string series = "1.2.826.0.1.3680043.2.1125.1";
  int instance = 1;
  double slope = 1, intercept = 0;
  std::vector<std::int16_t> values;
  std::string syntax = "1.2.840.10008.1.2.1";
  std::map<std::uint32_t, std::string> others;  ///< by tag: their elements, for the usual ones

  /// Adds or replaces an element; an empty type leaves it out.
  void set(std::uint16_t group, std::uint16_t number, const std::string& type,
           const std::string& value = {}) {
    others[std::uint32_t{group} << 16 | number] =
        type.empty() ? "" : dicom_element(group, number, type, value);
  }
};
/// One CT slice, explicit little-endian.
[[nodiscard]] std::string dicom(const DicomSpec& spec);
/// A DICOM number of 16 bits.
[[nodiscard]] inline std::string u16(int value) {
  return bytes_of(static_cast<std::uint16_t>(value));
}

/// Slice k of a 3 x 4 x 5 series with the values 12 k .. 12 k + 11, 2 mm apart.
[[nodiscard]] DicomSpec dicom_slice(int k);
/// Writes five slices, each changed, in an order of names that is not their order in space.
void write_dicom_series(const TemporaryFolder& folder,
                        const std::function<void(DicomSpec&, int)>& change);
/// What reading such a series says, in one line; "no error" for nothing.
[[nodiscard]] std::string series_message(const std::function<void(DicomSpec&, int)>& change);

/// The message of the LoadError that reading throws; "no error" without one.
[[nodiscard]] std::string refusal(const std::filesystem::path& path,
                                  const ReadOptions& options = {});

/// Whether a volume holds these, in their order.
[[nodiscard]] bool same_values(const SourceVolume& volume, const std::vector<float>& values);

/// Position of the centre of voxel (i, j, k) in the frame of the file, mm.
[[nodiscard]] std::array<double, 3> position_of(const VolumeFrame& frame, double i, double j,
                                                double k);

/// Positions in LPS of the voxels of a file: (0, 0, 0), and the step along each axis of the file.
struct FilePlaces {
  std::array<double, 3> origin{};
  std::array<std::array<double, 3>, 3> steps{{{1, 0, 0}, {0, 2, 0}, {0, 0, 3}}};
};
/// The first voxel of a volume of counting values (above) that does not lie at its place; empty if
/// all do.
[[nodiscard]] std::string misplaced(const SourceVolume& volume, const FilePlaces& places = {});

/// What may stand for a one-line message: `place: value; way out`.
[[nodiscard]] bool is_one_line(const std::string& message);

/// What kerf-volume says to these arguments.
struct Outcome {
  int code = 0;
  std::string out, err;
};
[[nodiscard]] Outcome run(const std::vector<std::string>& arguments);

/// An image of `grid`, all air.
[[nodiscard]] VolumeImage air(VoxelGrid grid);

}  // namespace kerf::test
