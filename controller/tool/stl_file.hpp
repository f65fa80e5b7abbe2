// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "controller/sandbox/sandbox.hpp"
#include "controller/tool/tool_mesh.hpp"

namespace kerf {

/// Largest STL file: as text a triangle takes some 300 bytes.
inline constexpr std::uintmax_t kMaxStlBytes = std::uintmax_t{512} * kMaxMeshTriangles;

/// The triangles of an STL file, binary or text, in the file's own unit; its normals are not read.
///
/// Binary: 80 bytes of header, u32 count, then 50 bytes each: normal and three corners as f32, and
/// two bytes that mean nothing; little-endian. Text: `solid`, `facet normal`, `outer loop`, three
/// `vertex`, `endloop`, `endfacet`, `endsolid`, in any case; several solids are one mesh. A file
/// whose size is that of its binary count is binary, whatever its first word; of others one without
/// a zero byte is text.
///
/// `place` begins a complaint. Throws SceneError with the line or the number of bytes where it is
/// anything else, or above kMaxMeshTriangles. Any thread; load time.
[[nodiscard]] std::vector<LooseTriangle> parse_stl(std::string_view bytes,
                                                   const std::string& place);

/// The same of a file of at most kMaxStlBytes, in a sandbox.
[[nodiscard]] std::vector<LooseTriangle> read_stl(const std::filesystem::path& path,
                                                  int cpu_s = kReadCpuSeconds);

}  // namespace kerf
