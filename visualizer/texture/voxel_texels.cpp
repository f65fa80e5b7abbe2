// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/voxel_texels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "shared/segment/brick_grid.hpp"
#include "shared/volume/voxel_loops.hpp"

namespace kerf {

namespace {

constexpr std::int32_t kMaterialReach = 2;  // voxels; a border is antialiased over two

/// 128.5 is the middle of what becomes 128.
std::uint8_t gradient_byte(float gradient) noexcept {
  return static_cast<std::uint8_t>(gradient * 127.0F + 128.5F);
}

std::uint8_t density_byte(std::int32_t density) noexcept {
  return static_cast<std::uint8_t>((density * 255 + 32767) / 65535);
}

std::uint8_t unit_byte(double value) noexcept {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255.0));
}

MaterialTexel texel_of(const glm::vec4& look) noexcept {
  const glm::dvec4 v(look);
  return {unit_byte(v.r), unit_byte(v.g), unit_byte(v.b), unit_byte(v.a)};
}

/// Colours the voxels of one brick that have no label; `around` is the brick grown by the reach.
class UnlabelledVoxels {
 public:
  UnlabelledVoxels(const VoxelGrid& grid, std::span<const Label> labels, const Palette& palette)
      : grid_(grid), labels_(labels), palette_(palette) {}

  [[nodiscard]] bool any_label(const VoxelBox& box) const {
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const auto row = labels_.subspan(grid_.index(box.lo.x, y, z),
                                         static_cast<std::size_t>(box.hi.x - box.lo.x));
        if (std::any_of(row.begin(), row.end(), [](Label l) { return l != 0; })) return true;
      }
    }
    return false;
  }

  /// The mean of the labelled voxels around `at`, the nearer the heavier; none where there are
  /// none.
  [[nodiscard]] std::optional<glm::vec4> mean_around(VoxelIndex at) const {
    const VoxelBox box =
        VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}}.grown(kMaterialReach).clipped(grid_.box());
    glm::vec4 sum(0.0F);
    float weights = 0.0F;
    for_each_voxel(box, [&](int x, int y, int z) {
      const Label label = labels_[grid_.index(x, y, z)];
      if (label == 0) return;
      const glm::ivec3 d(x - at.x, y - at.y, z - at.z);
      const float weight = 1.0F / static_cast<float>(d.x * d.x + d.y * d.y + d.z * d.z);
      sum += weight * palette_[1][label];
      weights += weight;
    });
    if (weights == 0.0F) return std::nullopt;
    return sum / weights;
  }

 private:
  const VoxelGrid& grid_;
  std::span<const Label> labels_;
  const Palette& palette_;
};

}  // namespace

void fill_gradient_texels(Gradient kind, const VoxelGrid& grid, std::span<const Density> density,
                          const VoxelBox& box, std::vector<GradientTexel>& texels) {
  std::vector<glm::vec3> gradients;
  fill_gradients(kind, grid, density, box, gradients);
  texels.clear();
  texels.reserve(gradients.size());
  auto gradient = gradients.begin();
  for_each_voxel(box, [&](int x, int y, int z) {
    const glm::vec3& g = *gradient++;
    texels.push_back({gradient_byte(g.x), gradient_byte(g.y), gradient_byte(g.z),
                      density_byte(density[grid.index(x, y, z)])});
  });
}

std::vector<MaterialTexel> material_texels(const VoxelGrid& grid, std::span<const Density> density,
                                           std::span<const Label> labels, const Palette& palette) {
  std::array<MaterialTexel, kPaletteWidth> by_density{};
  std::array<MaterialTexel, kPaletteWidth> by_label{};
  for (std::size_t i = 0; i < kPaletteWidth; ++i) {
    by_density[i] = texel_of(palette[0][i]);
    by_label[i] = texel_of(palette[1][i]);
  }
  std::vector<MaterialTexel> texels(grid.voxel_count());
  const UnlabelledVoxels unlabelled(grid, labels, palette);
  const BrickGrid bricks = BrickGrid::of(grid);
  for (std::uint32_t id = 0; id < bricks.count(); ++id) {
    const VoxelBox box = bricks.voxels(id);
    const bool near_labels = unlabelled.any_label(box.grown(kMaterialReach).clipped(grid.box()));
    for_each_voxel(box, [&](int x, int y, int z) {
      const std::size_t at = grid.index(x, y, z);
      if (labels[at] != 0) {
        texels[at] = by_label[labels[at]];
        return;
      }
      const auto mean = near_labels ? unlabelled.mean_around({x, y, z}) : std::nullopt;
      texels[at] = mean ? texel_of(*mean) : by_density[density_byte(density[at])];
    });
  }
  return texels;
}

}  // namespace kerf
