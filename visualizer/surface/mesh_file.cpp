// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/mesh_file.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>

namespace kerf {

namespace {

static_assert(std::endian::native == std::endian::little, "mesh files are little-endian");
static_assert(sizeof(glm::vec3) == 3 * sizeof(float));

template <typename T>
void append(std::string& bytes, const T& value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof(T));
  std::memcpy(&bytes[at], &value, sizeof(T));
}

void append(std::string& bytes, const std::string& text) {
  bytes += text;
}

std::uint8_t srgb8(float linear) {
  const double c = linear <= 0.0031308F
                       ? 12.92 * static_cast<double>(linear)
                       : 1.055 * std::pow(static_cast<double>(linear), 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255.0 * c));
}

}  // namespace

std::string stl_bytes(const ClosedMesh& mesh) {
  constexpr std::size_t kHeader = 80;
  constexpr std::size_t kTriangle = 50;
  std::string header = "kerf " KERF_VERSION ", mm";  // must not begin with "solid": that is text
  header.resize(kHeader, ' ');
  std::string bytes;
  bytes.reserve(kHeader + sizeof(std::uint32_t) + kTriangle * mesh.triangles.size());
  append(bytes, header);
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    const glm::vec3& a = mesh.vertices[triangle[0]].position_mm;
    const glm::vec3& b = mesh.vertices[triangle[1]].position_mm;
    const glm::vec3& c = mesh.vertices[triangle[2]].position_mm;
    const glm::dvec3 across =
        glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a));
    const double length = glm::length(across);
    append(bytes, length > 0.0 ? glm::vec3(across / length) : glm::vec3(0.0F));
    for (const glm::vec3& corner : {a, b, c}) append(bytes, corner);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string ply_bytes(const ClosedMesh& mesh) {
  std::string bytes;
  constexpr std::size_t kVertex = 2 * sizeof(glm::vec3) + 3;
  constexpr std::size_t kFace = 1 + 3 * sizeof(std::uint32_t);
  bytes.reserve(512 + kVertex * mesh.vertices.size() + kFace * mesh.triangles.size());
  append(bytes, "ply\nformat binary_little_endian 1.0\ncomment kerf " KERF_VERSION ", mm\n" +
                    ("element vertex " + std::to_string(mesh.vertices.size())) +
                    "\nproperty float x\nproperty float y\nproperty float z\n"
                    "property float nx\nproperty float ny\nproperty float nz\n"
                    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                    "element face " +
                    std::to_string(mesh.triangles.size()) +
                    "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const ClosedMesh::Vertex& vertex : mesh.vertices) {
    append(bytes, vertex.position_mm);
    append(bytes, vertex.normal);
    for (int i = 0; i < 3; ++i) append(bytes, srgb8(vertex.colour[i]));
  }
  for (const auto& triangle : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, triangle);
  }
  return bytes;
}

}  // namespace kerf
