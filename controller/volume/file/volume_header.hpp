// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

namespace kerf {

/// What a volume file tells about itself and ITK's readers do not pass on: they fill in a missing
/// spacing with 1, wrap huge sizes to 32 bits, and (MetaImage, NIfTI) take a cut-off file for
/// whole.
struct VolumeHeader {
  bool has_spacing = true;
  /// The most bytes of voxels that the file can hold, given its size and encoding.
  std::uint64_t data_bytes_at_most = std::numeric_limits<std::uint64_t>::max();
  std::string data_file;  ///< where they lie, for messages
  bool leaves_out =
      false;  ///< MetaImage, in several files or packed: what cannot be read is left out
};

/// In small letters, of ASCII alone: so keys of headers and ends of file names are compared.
[[nodiscard]] std::string lower(std::string text);

/// Each reads one header, checks sizes against the limits, and throws SceneError for what it can
/// judge: no header, bad sizes, zero spacing, no data file.
[[nodiscard]] VolumeHeader read_nrrd_header(const std::filesystem::path& path);
[[nodiscard]] VolumeHeader read_meta_header(const std::filesystem::path& path);

/// NIfTI-1 and -2 in one file, gzipped or not. Also walks the data, because the NIfTI library
/// neither reports missing bytes nor keeps NaN (it reads them as 0): both are refused here.
[[nodiscard]] VolumeHeader read_nifti_header(const std::filesystem::path& path);

/// TIFF, classic or big. libtiff takes a file that is cut off for one of fewer pages: the chain of
/// pages is followed here to its end.
[[nodiscard]] VolumeHeader read_tiff_header(const std::filesystem::path& path);

/// One line for voxels that are not numbers: how many, and the place of the first.
[[noreturn]] void refuse_not_finite(const std::filesystem::path& path, std::uint64_t count,
                                    std::uint64_t first_index, std::uint64_t nx, std::uint64_t ny);

/// One line for a file that ends too early.
[[noreturn]] void refuse_truncated(const std::string& file, std::uint64_t held,
                                   std::uint64_t expected);

}  // namespace kerf
