// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "shared/text/json.hpp"

// Checksums of the files of a recording that have none of their own: zlib's CRC-32, of which every
// language has a function.

namespace kerf {

/// The checksum of a regular file's bytes, as 8 hexadecimal digits; empty if it cannot be read.
[[nodiscard]] std::string crc32_of_file(const std::filesystem::path& path);

/// The checksum of bytes, as 8 hexadecimal digits.
[[nodiscard]] std::string crc32_of_bytes(std::string_view bytes);

/// The names in `folder` of the files below a folder of a recording, as "volumes/NAME". In order.
[[nodiscard]] std::vector<std::string> names_below(const std::filesystem::path& folder,
                                                   std::string_view below);

/// The names of the files of a recording that `checksums_of` has, if they are there: scene.json,
/// clock.npy and what is in volumes/, inputs/ and inputs-2/. In order.
[[nodiscard]] std::vector<std::string> names_of_files(const std::filesystem::path& folder);

/// Their checksums, by name: the member `files` of a manifest.
[[nodiscard]] Json checksums_of(const std::filesystem::path& folder);

/// The text of manifest.json: `manifest` with a last member, `crc32`, the checksum of all bytes
/// before the comma in front of it.
[[nodiscard]] std::string sealed(const Json& manifest);

enum class Seal {
  none,   ///< of an earlier version
  whole,  ///< the text is as `sealed` made it
  broken
};
[[nodiscard]] Seal seal_of(std::string_view manifest_text);

}  // namespace kerf
