// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

// One DICOM file as a list of frames: a slice of a series has one, an enhanced CT has hundreds. In
// the sandbox. PS3.3 and PS3.5 are parts of the DICOM standard.

namespace kerf::volume {

/// A number as the text of a file has it (PS3.5 6.2, DS), and the digits after its point, without
/// zeros at the end.
struct WrittenNumber {
  double value = 0;
  int decimals = 0;
};
/// The most by which a writer has changed a number with so many decimals; 0 for whole numbers,
/// which are chosen and not rounded.
[[nodiscard]] double rounding_of(int decimals) noexcept;

/// Values of a Modality LUT (PS3.3 C.11.1.1): the first is that of the stored value `first` and of
/// all below it, the last that of all above.
struct DicomLut {
  std::int64_t first = 0;
  std::vector<std::int32_t> values;
};

/// From stored values to the file's units, such as HU: a table, or a line (PS3.3 C.11.1).
struct ModalityTransform {
  double slope = 1, intercept = 0;
  std::shared_ptr<const DicomLut> lut;  ///< if set, it counts instead of the line
  bool operator==(const ModalityTransform&) const = default;
};

struct DicomFrame {
  std::size_t index = 0;  ///< in its file
  std::optional<std::array<WrittenNumber, 3>> position_mm;
  std::optional<std::array<WrittenNumber, 6>> orientation;  ///< along a row, along a column
  std::optional<std::array<WrittenNumber, 2>> spacing_mm;   ///< between rows, between columns
  std::string bad_spacing;                   ///< PixelSpacing, if it is there and no two distances
  std::optional<double> distance_mm;         ///< to the next slice, if above 0
  std::optional<WrittenNumber> location_mm;  ///< SliceLocation
  std::optional<double> number;              ///< in the order of its series or file
  ModalityTransform transform;
  /// What may differ between two volumes in one series, such as a time: its name and its text.
  std::vector<std::pair<std::string, std::string>> marks;
};

/// The mark of frames that belong together in space.
inline constexpr const char* kStackMark = "StackID";

/// How the values of all frames of a file are stored.
struct StoredPixels {
  std::int64_t columns = 0, rows = 0;
  unsigned allocated = 16, stored = 16, high_bit = 15;  ///< bits
  bool is_signed = false, is_float = false;
  enum class In : std::uint8_t { file, data_set, fragments } in = In::file;
  bool big_endian = false, words = true;  ///< in the file; words: bytes lie in pairs
  std::uint64_t offset = 0;               ///< of the first frame in the file
  std::string syntax;                     ///< of fragments: UID of their encoding
  /// From the first to the last stored value that is no part of the picture (PS3.3 C.7.5.1.1.2).
  std::optional<std::pair<double, double>> padding;

  [[nodiscard]] std::size_t cells() const noexcept {
    return static_cast<std::size_t>(columns * rows);
  }
  [[nodiscard]] std::size_t frame_bytes() const noexcept { return cells() * (allocated / 8); }
};

/// Where and what a file is; its frames if they may be slices of a volume.
struct DicomFile {
  std::filesystem::path path;
  double series_number = 0;
  std::string series, series_name;  ///< UID, description
  StoredPixels pixels;
  bool in_hounsfield = false;
  std::string remark;  ///< for the user, or empty
  std::vector<DicomFrame> frames;

  std::string unfit, way_out;  ///< why it has no frames, and what to do; or empty
  bool is_slice = false;       ///< unfit, and its series is incomplete without it
  bool is_index = false;       ///< a DICOMDIR of any name, or a cut object that is no image
};

/// Reads a file up to its pixels; none if it is not DICOM. One that may have been DICOM, as it
/// cannot be opened, is empty or has zeroes alone, is unfit and of no series. Throws nothing but
/// std::bad_alloc: what is wrong with the file is in `unfit`.
[[nodiscard]] std::optional<DicomFile> read_dicom_header(const std::filesystem::path& path);

}  // namespace kerf::volume
