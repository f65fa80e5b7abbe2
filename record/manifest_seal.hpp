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

/// The names in `folder` of the files of a recording that `checksums_of` has: scene.json, and with
/// `all` clock.npy and what is in volumes/, inputs/ and inputs-2/. In order.
[[nodiscard]] std::vector<std::string> names_of_files(const std::filesystem::path& folder,
                                                      bool all);

/// Their checksums, by name: the member `files` of a manifest. A recorder that still runs has no
/// volumes yet; it leaves `all` out.
[[nodiscard]] Json checksums_of(const std::filesystem::path& folder, bool all);

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
