// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include <zlib.h>

// What the readers of volume files share: packed files, names in any case, complaints.

namespace kerf::volume {

struct CloseGz {
  void operator()(gzFile file) const noexcept { gzclose(file); }
};
/// A file that zlib reads, packed or not; closed with the object.
using GzFile = std::unique_ptr<gzFile_s, CloseGz>;

}  // namespace kerf::volume

namespace kerf {

/// In lower case, ASCII only: for comparing keys of headers and ends of file names.
[[nodiscard]] std::string lower(std::string text);

/// One line for voxels that are not numbers: how many, and the place of the first.
[[noreturn]] void refuse_not_finite(const std::filesystem::path& path, std::uint64_t count,
                                    std::uint64_t first_index, std::uint64_t nx, std::uint64_t ny);

/// One line for a file that is empty, or that a library gives up for a reason.
[[noreturn]] void refuse_unreadable(const std::filesystem::path& path, const std::string& reason);

/// One line for a file that ends too early.
[[noreturn]] void refuse_truncated(const std::string& file, std::uint64_t held,
                                   std::uint64_t expected);

}  // namespace kerf
