// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/volume/file/dicom_header.hpp"
#include "controller/volume/file/volume_image.hpp"

// From the stored bytes of frames to values. In the sandbox.

namespace kerf::volume {

/// A frame and its file.
struct DicomSlice {
  const DicomFile* file = nullptr;
  const DicomFrame* frame = nullptr;
};

/// Kind of values that holds those of all slices, and air in their units if they have any.
struct DicomValues {
  ValueKind kind = ValueKind::float32;
  /// -1000 HU (PS3.3 C.11.1.1.2), if all slices are in HU and can store that value. Padding becomes
  /// this, or else the lowest value of the volume that is no padding.
  std::optional<float> air;
  bool marks_padding = false;  ///< there is padding, and air is not known
};
[[nodiscard]] DicomValues values_of(const std::vector<DicomSlice>& slices);

/// Reads frames, one after the other; those of one file in a row are the fastest.
class DicomPixels {
 public:
  explicit DicomPixels(const DicomValues& values);
  ~DicomPixels();
  DicomPixels(const DicomPixels&) = delete;
  DicomPixels& operator=(const DicomPixels&) = delete;

  /// Fills `to`, one value of the kind for each pixel, x fastest. Tags that concern the display
  /// alone (MONOCHROME1, windows, PresentationLUTShape, overlays) change nothing. Throws LoadError
  /// for pixels that are missing or cannot be decoded.
  void read(const DicomSlice& slice, std::span<std::byte> to);

  /// Once all slices are read into `all`, in order: padding becomes the lowest other value.
  void fill_padding(std::span<std::byte> all) const;

 private:
  struct OpenFile;
  void open(const DicomFile& file);
  void read_cells(const DicomSlice& slice);
  template <class T>
  void convert(const DicomSlice& slice, std::span<std::byte> to);

  DicomValues values_;
  std::unique_ptr<OpenFile> open_;
  std::vector<std::byte> cells_;  ///< of one frame, in this machine's byte order
  std::vector<bool> padded_;      ///< of all values so far, if padding is marked
};

}  // namespace kerf::volume
