// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kerf {

/// Rows from the top, 8 bits of red, green and blue.
struct RgbPicture {
  std::int32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// The bytes of a PNG file (ISO 15948). Throws std::bad_alloc.
[[nodiscard]] std::string png_bytes(const RgbPicture& picture);

}  // namespace kerf
