// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/volume_surface.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <glm/gtc/matrix_inverse.hpp>

#include "shared/posix/atomic_file.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/caster.hpp"
#include "visualizer/scene/visualizer_error.hpp"
#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

namespace {

/// Blocks of which a sample lies in `box`: block i has samples 8i-1 to 8i+7.
VoxelBox blocks_on(const VoxelBox& box) {
  static_assert(kBlockEdge == 8);
  return {{box.lo.x >> 3, box.lo.y >> 3, box.lo.z >> 3},
          {(box.hi.x >> 3) + 1, (box.hi.y >> 3) + 1, (box.hi.z >> 3) + 1}};
}

glm::vec3 inverse_square_spacing(const glm::dmat4& world_from_voxel) {
  glm::dvec3 inverse;
  for (int axis = 0; axis < 3; ++axis) {
    inverse[axis] = 1.0 / glm::dot(world_from_voxel[axis], world_from_voxel[axis]);
  }
  return inverse / std::max({inverse.x, inverse.y, inverse.z});
}

}  // namespace

VolumeSurface::VolumeSurface(const VolumeView& volume, const std::vector<MaterialView>& materials,
                             std::span<const Density> density, std::span<const Label> labels,
                             GradientFilter gradient)
    : bricks_(volume.bricks),
      blocks_(block_grid(volume.bricks.grid)),
      iso_(std::max(volume.iso, Density{1})),
      inverse_square_spacing_(inverse_square_spacing(volume.world_from_voxel)),
      shading_(materials, iso_, volume.edges_mm()),
      gradient_(GradientPlan(gradient, volume.edges_mm()), bricks_.grid, density),
      labels_(labels.begin(), labels.end()),
      meshes_(blocks_.voxel_count()),
      work_(blocks_.voxel_count(), Work::none) {
  const SurfaceSource from = source(density);
  TilePool().run(static_cast<std::uint32_t>(blocks_.nz), [&](std::uint32_t layer) {
    const auto z = static_cast<std::int32_t>(layer);
    for (std::int32_t y = 0; y < blocks_.ny; ++y) {
      for (std::int32_t x = 0; x < blocks_.nx; ++x) {
        meshes_[blocks_.index(x, y, z)] = extract_block(from, {x, y, z});
      }
    }
  });
}

SurfaceSource VolumeSurface::source(std::span<const Density> density) const {
  return {{bricks_.grid, density, labels_}, iso_, inverse_square_spacing_, &shading_, &gradient_};
}

VoxelIndex VolumeSurface::block(std::uint32_t id) const noexcept {
  const auto i = static_cast<std::int32_t>(id);
  return {i % blocks_.nx, i / blocks_.nx % blocks_.ny, i / blocks_.nx / blocks_.ny};
}

void VolumeSurface::mark(const VoxelBox& blocks, Work work) {
  const VoxelBox near = blocks.clipped(blocks_.box());
  for_each_voxel(near, [&](int x, int y, int z) {
    const std::size_t id = blocks_.index(x, y, z);
    if (work_[id] == Work::none) marked_.push_back(static_cast<std::uint32_t>(id));
    work_[id] = std::max(work_[id], work);
  });
}

std::span<const std::uint32_t> VolumeSurface::update(std::span<const Density> density,
                                                     const ChangedBricks& changed) {
  gradient_.update(changed, density);
  const SurfaceSource from = source(density);
  VoxelBox all;
  for (const ChangedBrick& brick : changed) {
    const VoxelBox box = ChangedBricks::bounds(brick, bricks_);
    if (box.empty()) continue;
    all = all.united(box);
    mark(blocks_on(box), Work::mesh);
    mark(blocks_on(shaded_around(box, from)), Work::shading);
  }
  std::sort(marked_.begin(), marked_.end());
  different_.clear();
  changed_triangles_.clear();
  for (const std::uint32_t id : marked_) {
    BlockMesh& mesh = meshes_[id];
    const Work work = std::exchange(work_[id], Work::none);
    if (work == Work::shading && mesh.vertices.empty()) continue;
    ChangedMeshCells cells;
    if (work == Work::shading) {
      cells = update_shading(from, block(id), all, mesh);
    } else {
      BlockMesh now = extract_block(from, block(id));
      cells = difference(mesh, now);
      cells.append_triangles(mesh, block(id), changed_triangles_);
      mesh = std::move(now);
    }
    if (!cells.any()) continue;
    cells.append_triangles(mesh, block(id), changed_triangles_);
    different_.push_back(id);
  }
  marked_.clear();
  return different_;
}

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

/// On a face of its block, where another block may have it too.
bool is_shared(const SurfaceVertex& vertex) {
  constexpr int kEnd = kBlockEdge * kFinePerVoxel;
  return std::any_of(vertex.position.begin(), vertex.position.end(),
                     [](std::uint16_t at) { return at == 0 || at == kEnd; });
}

/// The cube edge that a vertex lies on: its axis and start, 17 bits each.
std::uint64_t edge_of(FinePoint at) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key = key << 17 | static_cast<std::uint64_t>((at[axis] >> kFineLog2) + 1);
  }
  for (int axis = 0; axis < 3; ++axis) {
    key = key << 1 | ((at[axis] & (kFinePerVoxel - 1)) != 0 ? 1U : 0U);
  }
  return key;
}

/// The mesh as the bytes of a binary STL file: triangles with the normal of their plane. STL has no
/// colours and names no unit; ours are mm, as most readers take it.
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

/// The mesh as the bytes of a binary little-endian PLY file: position, normal and sRGB colour of
/// each vertex, and triangles.
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

struct Format {
  std::string_view ending;
  std::string (*bytes)(const ClosedMesh&);
};
constexpr auto kFormats = std::to_array<Format>({{".stl", stl_bytes}, {".ply", ply_bytes}});

const Format& format_of(const std::filesystem::path& file) {
  const auto found = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) {
    return file.extension() == format.ending;
  });
  if (found != kFormats.end()) return *found;
  throw VisualizerError("--export: " + file.string() +
                        ": the name says no format; let it end in .stl or .ply");
}

}  // namespace

void ClosedMesh::append(const VolumeSurface& surface, const glm::dmat4& world_from_voxel) {
  const glm::dmat3 world_from_normal = glm::inverseTranspose(glm::dmat3(world_from_voxel));
  std::unordered_map<std::uint64_t, std::uint32_t> shared;
  std::vector<std::uint32_t> index;  // of the block's vertices here
  for (std::uint32_t id = 0; id < surface.meshes().size(); ++id) {
    const BlockMesh& block = surface.meshes()[id];
    const VoxelIndex start = block_start(surface.block(id));
    index.clear();
    for (const SurfaceVertex& vertex : block.vertices) {
      const FinePoint at = fine_place(vertex, start);
      const auto fresh = static_cast<std::uint32_t>(vertices.size());
      const std::uint32_t known =
          is_shared(vertex) ? shared.try_emplace(edge_of(at), fresh).first->second : fresh;
      index.push_back(known);
      if (known != fresh) continue;
      const glm::dvec3 voxel = glm::dvec3(at) / double{kFinePerVoxel};
      const glm::dvec3 normal(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
      constexpr float kOne = 65535.0F;
      vertices.push_back({glm::vec3(world_from_voxel * glm::dvec4(voxel, 1.0)),
                          glm::vec3(glm::normalize(world_from_normal * normal)),
                          glm::vec3(vertex.colour[0], vertex.colour[1], vertex.colour[2]) / kOne});
    }
    for (const auto& triangle : block.triangles) {
      triangles.push_back({index[triangle[0]], index[triangle[1]], index[triangle[2]]});
    }
  }
}

void check_export(const std::filesystem::path& file) {
  static_cast<void>(format_of(file));
  check_new_file(file);
}

void export_surface(const std::filesystem::path& file, const SceneView& scene,
                    std::span<const VolumeContent> contents) {
  const Format& format = format_of(file);
  const bool some_solid = scene.main_volume().solid;
  ClosedMesh mesh;
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    const VolumeView& volume = scene.volumes[i];
    if (some_solid ? !volume.solid : i != 0) continue;
    mesh.append(VolumeSurface(volume, scene.materials, contents[i].density, contents[i].labels,
                              scene.gradient),
                volume.world_from_voxel);
  }
  write_new_file(file, format.bytes(mesh));
}

}  // namespace kerf
