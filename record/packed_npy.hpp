// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "record/npy_header.hpp"
#include "shared/posix/atomic_file.hpp"

// Arrays beside a log as NumPy's format, packed: `np.load(gzip.open(path))`.

namespace kerf {

/// Throws `RecordError` if the right to read a file or folder of a recording is missing.
void require_rights(const std::filesystem::path& path);

/// No such file with `bytes` of content is larger: what deflate cannot pack it stores, with 5 bytes
/// for each 16 KiB; header and gzip need less than a page.
[[nodiscard]] constexpr std::uintmax_t most_packed_bytes(std::uintmax_t bytes) noexcept {
  return bytes + bytes / 1024 + 4096;
}

/// Writes header and content into `file` as gzip and closes it. Throws FileError.
void write_packed_npy(AtomicFile& file, std::string_view header,
                      std::span<const std::byte> content);

/// Reads such a file piece by piece.
class PackedNpyReader {
 public:
  /// If the file is not a regular one, or does not begin with `header`, `is_sound` is false.
  PackedNpyReader(const std::filesystem::path& path, std::string_view header);

  /// Whether the file began with `header` and every read so far succeeded.
  [[nodiscard]] bool is_sound() const noexcept { return file_ != nullptr; }
  /// Fills `content` with the next bytes; false if there are not as many.
  [[nodiscard]] bool read(std::span<std::byte> content);
  /// Whether the file ends here, complete. False if its checksum is wrong or cut off.
  [[nodiscard]] bool at_end();

 private:
  struct Close {
    void operator()(void* file) const noexcept;
  };
  std::unique_ptr<void, Close> file_;  ///< gzFile; null: nothing can be read
};

}  // namespace kerf
