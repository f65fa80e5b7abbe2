// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "visualizer/gl/names.hpp"
#include "visualizer/surface/frustum_culling.hpp"
#include "visualizer/surface/range_pool.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

/// A GL buffer that keeps its content when it grows.
class GrowingBuffer {
 public:
  /// Room for `bytes`; true where the buffer is another one now.
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
/// Of a block that is only partly visible the visible triangles are picked and
/// uploaded at each draw: to pick one costs far less than to draw it in software.
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
  struct Command {
    std::uint32_t indices, instances, first_index, base_vertex, base_instance;
  };

  /// A block that is visible; all of it, or some.
  struct Seen {
    float distance_2;
    std::uint32_t id;
    bool all;
    auto operator<=>(const Seen&) const = default;
  };

  void look_from(const VolumeSurface& surface, const FrustumCulling& culling);
  /// Room for all that the pools hold.
  void grow();
  /// And lets the commands of `of_picked_` read from there.
  void upload_picked();

  std::vector<Part> parts_;            ///< by block
  std::vector<std::uint32_t> filled_;  ///< blocks with triangles, ascending: few of all
  RangePool vertex_pool_;
  RangePool triangle_pool_;
  GrowingBuffer vertices_;
  GrowingBuffer triangles_;
  GlBuffer starts_ = GlBuffer::create();  ///< block indices, the instance attribute
  std::vector<Seen> seen_;                ///< front to back
  std::vector<Command> commands_;
  std::vector<BlockTriangle> picked_;   ///< of blocks that are not drawn whole
  std::vector<std::size_t> of_picked_;  ///< commands that draw them
  RangePool::Range picked_range_;
  GlBuffer command_buffer_ = GlBuffer::create();
  GlVertexArray array_ = GlVertexArray::create();
};

}  // namespace kerf
