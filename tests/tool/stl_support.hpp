// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "controller/tool/tool_mesh.hpp"

namespace kerf::test {

/// Low byte first.
inline void append_word(std::string& bytes, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(word >> 8 * i & 0xff);
}

/// A binary STL file.
inline std::string binary_stl(const std::vector<LooseTriangle>& triangles) {
  std::string bytes(80, ' ');
  append_word(bytes, static_cast<std::uint32_t>(triangles.size()));
  for (const LooseTriangle& triangle : triangles) {
    bytes.append(12, '\0');  // a normal that nobody reads
    for (const auto& corner : triangle) {
      for (const float x : corner) append_word(bytes, std::bit_cast<std::uint32_t>(x));
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

/// The same as text.
inline std::string text_stl(const std::vector<LooseTriangle>& triangles) {
  std::ostringstream text;
  text.precision(9);
  text << "solid a bur\n";
  for (const LooseTriangle& triangle : triangles) {
    text << "  facet normal 0 0 0\n    outer loop\n";
    for (const auto& [x, y, z] : triangle) {
      text << "      vertex " << x << ' ' << y << ' ' << z << '\n';
    }
    text << "    endloop\n  endfacet\n";
  }
  text << "endsolid a bur\n";
  return text.str();
}

}  // namespace kerf::test
