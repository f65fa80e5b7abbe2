// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/gl/gl_objects.hpp"
#include "visualizer/surface/block_mesh.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

/// Parts of one growing array, for meshes that come and go: a part has a power of two of elements,
/// and a freed one is taken again for a mesh of its size.
class RangePool {
 public:
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t capacity = 0;  ///< 0: none
  };

  /// Room for `count` elements, the old range of the same owner given back or kept; `count` 0 gives
  /// it back.
  [[nodiscard]] Range fit(Range old, std::uint32_t count) {
    const std::uint32_t capacity = count == 0 ? 0 : std::max(kLeast, std::bit_ceil(count));
    if (capacity == old.capacity) return old;
    if (old.capacity != 0) free_of(old.capacity).push_back(old.first);
    if (capacity == 0) return {};
    std::vector<std::uint32_t>& free = free_of(capacity);
    if (free.empty()) {
      free.push_back(size_);
      size_ += capacity;
    }
    const Range range{free.back(), capacity};
    free.pop_back();
    return range;
  }
  /// Elements that the array needs.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

 private:
  static constexpr std::uint32_t kLeast = 32;

  [[nodiscard]] std::vector<std::uint32_t>& free_of(std::uint32_t capacity) {
    return free_[static_cast<std::size_t>(std::countr_zero(capacity))];
  }

  std::array<std::vector<std::uint32_t>, 32> free_;  ///< by log2 of the capacity
  std::uint32_t size_ = 0;
};

/// Where the surface of a block lies and which way it faces, in voxel coordinates.
struct BlockBounds {
  glm::vec3 centre{0.0F};
  glm::vec3 half{0.0F};  ///< of the edges of the box around its vertices
  /// The box around the unit normals of its triangles.
  glm::vec3 normal_centre{0.0F};
  glm::vec3 normal_half{0.0F};
};
[[nodiscard]] BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block);

/// Culls the blocks of a surface, and the triangles of a block, against the view frustum of each
/// part of a picture that is drawn again. Conservative: what it leaves out covers no pixel; some of
/// what it keeps may cover none either.
class FrustumCulling {
 public:
  /// A rectangle of whole pixels in normalised device coordinates; the picture is -1 to 1.
  struct Part {
    glm::dvec2 lo, hi;
  };
  /// With `eye_voxel`, blocks that turn their back to the eye are culled too. Without it they are
  /// not: a clip plane opens the surface, and its inside shows.
  FrustumCulling(const glm::dmat4& clip_from_voxel, const std::optional<glm::dvec3>& eye_voxel,
                 std::span<const Part> parts);

  enum class Visible : std::uint8_t { nothing, some, all };
  /// `nothing`: the block is outside of all parts, or turns its back to the eye. `all`: it lies
  /// within one part. `some`: neither is certain.
  [[nodiscard]] Visible visible(const BlockBounds& block) const;

  /// Squared distance in voxel edges from the eye to the middle of the block, to sort blocks from
  /// front to back; 0 without an eye.
  [[nodiscard]] float distance_2(VoxelIndex block) const;

  /// Appends to `visible` the triangles of a block's mesh that may touch a part, in their order.
  void append_visible(const BlockMesh& mesh, const BlockBounds& bounds, VoxelIndex block,
                      std::vector<BlockTriangle>& visible) const;

 private:
  /// The four sides of a part's frustum; positive inside.
  using Planes = std::array<glm::vec4, 4>;

  std::optional<glm::vec3> eye_;
  std::array<glm::vec4, 2> near_far_;
  Planes around_;  ///< of the box around all parts: culls most blocks at once
  std::vector<Planes> parts_;
};

/// A GL buffer that keeps its content when it grows.
class GrowingBuffer {
 public:
  /// Room for `bytes`; true if the buffer is another one now.
  bool reserve(std::size_t bytes);
  void write(std::size_t offset, std::size_t bytes, const void* data) const;
  [[nodiscard]] GLuint id() const noexcept { return buffer_.id(); }

 private:
  GlBuffer buffer_ = GlBuffer::create();
  std::size_t bytes_ = 0;
};

/// The meshes of one volume in the memory of the GPU: all vertices in one buffer, all triangles in
/// another, drawn by one call.
///
/// Of a block that is only partly visible, the visible triangles are picked and uploaded at each
/// draw: to pick one costs far less than to draw it in software.
class SurfaceOnGpu {
 public:
  explicit SurfaceOnGpu(const VolumeSurface& surface);

  /// Uploads these blocks again, and nothing else.
  void update(const VolumeSurface& surface, std::span<const std::uint32_t> blocks);

  /// Draws what may be visible of the surface that was uploaded last, with the program in use;
  /// attributes as in surface.vert.
  void draw(const VolumeSurface& surface, const FrustumCulling& culling);

 private:
  struct Part {
    RangePool::Range vertices;
    RangePool::Range triangles;
    std::uint32_t count = 0;  ///< triangles
    BlockBounds bounds;
  };
  /// As GL reads it (DrawElementsIndirectCommand).
  struct DrawCommand {
    std::uint32_t indices, instances, first_index, base_vertex, base_instance;
  };

  /// A block that is visible; all of it, or some.
  struct Seen {
    float distance_2;
    std::uint32_t id;
    bool all;
    auto operator<=>(const Seen&) const = default;
  };

  void find_visible(const VolumeSurface& surface, const FrustumCulling& culling);
  /// Room for all that the pools hold.
  void grow();
  /// Uploads the triangles of `picked_`; the commands of `of_picked_` read them.
  void upload_picked();

  std::vector<Part> parts_;            ///< by block
  std::vector<std::uint32_t> filled_;  ///< blocks with triangles, ascending: few of all
  RangePool vertex_pool_;
  RangePool triangle_pool_;
  GrowingBuffer vertices_;
  GrowingBuffer triangles_;
  GlBuffer starts_ = GlBuffer::create();  ///< block indices, the instance attribute
  std::vector<Seen> seen_;                ///< front to back
  std::vector<DrawCommand> commands_;
  std::vector<BlockTriangle> picked_;   ///< of blocks that are not drawn whole
  std::vector<std::size_t> of_picked_;  ///< commands that draw them
  RangePool::Range picked_range_;
  GlBuffer command_buffer_ = GlBuffer::create();
  GlVertexArray array_ = GlVertexArray::create();
};

}  // namespace kerf
