// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>

#include <zlib.h>

#include "controller/volume/file/volume_image.hpp"

// Facts of a volume file's header that ITK's readers do not pass on, or judge badly.
// binary_headers.cpp reads NIfTI and TIFF.

namespace kerf::volume {

struct CloseGz {
  void operator()(gzFile file) const noexcept { gzclose(file); }
};
/// A file that zlib reads, packed or not; closed with the object.
using GzFile = std::unique_ptr<gzFile_s, CloseGz>;

}  // namespace kerf::volume

namespace kerf {

/// Facts of a header that ITK's readers do not pass on: they replace a missing spacing by 1, wrap
/// huge sizes to 32 bits, and (NIfTI) accept a cut-off file.
struct VolumeHeader {
  std::uint32_t spacing_known = kAllAxes;  ///< as in UntrustedHeader
  /// The most bytes of voxels that the file can hold, given its size and encoding.
  std::uint64_t data_bytes_at_most = std::numeric_limits<std::uint64_t>::max();
  std::string data_file;  ///< file of the voxels, for messages
};

/// In lower case, ASCII only: for comparing keys of headers and ends of file names.
[[nodiscard]] std::string lower(std::string text);

/// NIfTI-1 and -2 in one file, gzipped or not. Also walks the data, because the NIfTI library
/// neither reports missing bytes nor keeps NaN (it reads 0 for them): both are refused here.
[[nodiscard]] VolumeHeader read_nifti_header(const std::filesystem::path& path);

/// TIFF, classic or big. libtiff reads a cut-off file as one of fewer pages, so the chain of pages
/// is followed here to its end.
[[nodiscard]] VolumeHeader read_tiff_header(const std::filesystem::path& path);

/// One line for voxels that are not numbers: how many, and the place of the first.
[[noreturn]] void refuse_not_finite(const std::filesystem::path& path, std::uint64_t count,
                                    std::uint64_t first_index, std::uint64_t nx, std::uint64_t ny);

/// One line for a file that ends too early.
[[noreturn]] void refuse_truncated(const std::string& file, std::uint64_t held,
                                   std::uint64_t expected);

}  // namespace kerf
