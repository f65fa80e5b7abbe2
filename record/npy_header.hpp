// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace kerf {

/// The header of an NPY file, version 1, padded to `bytes`. `type` and `shape` are Python texts, as
/// "'<u2'" and "3, 4". The caller's texts fit.
[[nodiscard]] inline std::string npy_header(std::string_view type, std::string_view shape,
                                            std::size_t bytes) {
  constexpr std::size_t kPreamble = 10;  // magic, version, length of the text
  const std::size_t text = bytes - kPreamble;
  std::string header = "\x93NUMPY";
  header += {'\x01', '\0', static_cast<char>(text & 0xff), static_cast<char>(text >> 8)};
  header += "{'descr': " + std::string(type) + ", 'fortran_order': False, 'shape': (" +
            std::string(shape) + "), }";
  header.resize(bytes - 1, ' ');
  return header + '\n';
}

}  // namespace kerf
