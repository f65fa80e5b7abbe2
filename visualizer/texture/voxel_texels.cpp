// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/voxel_texels.hpp"

#include <algorithm>
#include <cmath>

#include "shared/volume/brick_grid.hpp"
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

MaterialTexels::MaterialTexels(const VoxelGrid& grid, std::span<const Label> labels,
                               const Palette& palette)
    : grid_(grid), labels_(labels), label_looks_(palette[1]) {
  for (std::size_t i = 0; i < kPaletteWidth; ++i) {
    by_density_[i] = texel_of(palette[0][i]);
    by_label_[i] = texel_of(palette[1][i]);
  }
}

bool MaterialTexels::any_label(const VoxelBox& box) const {
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const auto row = labels_.subspan(grid_.index(box.lo.x, y, z),
                                       static_cast<std::size_t>(box.hi.x - box.lo.x));
      if (std::any_of(row.begin(), row.end(), [](Label l) { return l != 0; })) return true;
    }
  }
  return false;
}

/// The mean of the labelled voxels around `at`, the nearer the heavier; none where there are none.
std::optional<glm::vec4> MaterialTexels::mean_around(VoxelIndex at) const {
  const VoxelBox box =
      VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}}.grown(kMaterialReach).clipped(grid_.box());
  glm::vec4 sum(0.0F);
  float weights = 0.0F;
  for_each_voxel(box, [&](int x, int y, int z) {
    const Label label = labels_[grid_.index(x, y, z)];
    if (label == 0) return;
    const glm::ivec3 d(x - at.x, y - at.y, z - at.z);
    const float weight = 1.0F / static_cast<float>(d.x * d.x + d.y * d.y + d.z * d.z);
    sum += weight * label_looks_[label];
    weights += weight;
  });
  if (weights == 0.0F) return std::nullopt;
  return sum / weights;
}

template <class Put>
void MaterialTexels::each(const VoxelBox& box, std::span<const Density> density,
                          const Put& put) const {
  const bool near_labels = any_label(box.grown(kMaterialReach).clipped(grid_.box()));
  for_each_voxel(box, [&](int x, int y, int z) {
    const std::size_t at = grid_.index(x, y, z);
    if (labels_[at] != 0) return put(at, by_label_[labels_[at]]);
    const auto mean = near_labels ? mean_around({x, y, z}) : std::nullopt;
    put(at, mean ? texel_of(*mean) : by_density_[density_byte(density[at])]);
  });
}

std::vector<MaterialTexel> MaterialTexels::of(const VoxelBox& box,
                                              std::span<const Density> density) const {
  std::vector<MaterialTexel> texels;
  each(box, density, [&](std::size_t, const MaterialTexel& texel) { texels.push_back(texel); });
  return texels;
}

std::vector<MaterialTexel> MaterialTexels::of_all(std::span<const Density> density) const {
  std::vector<MaterialTexel> texels(grid_.voxel_count());
  const BrickGrid bricks = BrickGrid::of(grid_);
  for (std::uint32_t id = 0; id < bricks.count(); ++id) {
    each(bricks.voxels(id), density,
         [&](std::size_t at, const MaterialTexel& texel) { texels[at] = texel; });
  }
  return texels;
}

}  // namespace kerf
