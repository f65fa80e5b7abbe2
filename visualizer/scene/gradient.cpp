// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/gradient.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "shared/text/text.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

/// A box of numbers, x fastest.
struct Field {
  explicit Field(VoxelIndex extent) : n(extent), values(VoxelGrid{n.x, n.y, n.z}.voxel_count()) {}
  [[nodiscard]] float* row(std::int32_t y, std::int32_t z) noexcept {
    return values.data() + static_cast<std::ptrdiff_t>(z * n.y + y) * n.x;
  }
  VoxelIndex n;
  std::vector<float> values;
};

/// The densities of a box, zeros outside the volume.
Field padded(const VoxelGrid& grid, std::span<const Density> density, const VoxelBox& box) {
  Field field(box.extent());
  const VoxelBox inside = box.clipped(grid.box());
  for (std::int32_t z = inside.lo.z; z < inside.hi.z; ++z) {
    for (std::int32_t y = inside.lo.y; y < inside.hi.y; ++y) {
      const Density* const from = density.data() + grid.index(inside.lo.x, y, z);
      std::copy_n(from, inside.hi.x - inside.lo.x,
                  field.row(y - box.lo.y, z - box.lo.z) + inside.lo.x - box.lo.x);
    }
  }
  return field;
}

/// Taps along one axis, which becomes shorter by their reach at both ends.
template <GradientFilter kKind, bool kSlope, int kAxis>
Field filtered(Field& from) {
  constexpr FilterTaps kBoth = gradient_taps(kKind);
  constexpr std::array<float, 15> kTaps = kSlope ? kBoth.slope : kBoth.smooth;
  constexpr int kReach = gradient_reach(kKind);
  constexpr std::size_t kMiddle = 7;
  VoxelIndex n = from.n;
  (kAxis == 0 ? n.x : kAxis == 1 ? n.y : n.z) -= 2 * kReach;
  Field to(n);
  const std::ptrdiff_t stride = kAxis == 0 ? 1 : kAxis == 1 ? from.n.x : from.n.x * from.n.y;
  for (std::int32_t z = 0; z < n.z; ++z) {
    for (std::int32_t y = 0; y < n.y; ++y) {
      const float* const in = from.row(y, z) + kReach * stride;
      float* const out = to.row(y, z);
      for (std::int32_t x = 0; x < n.x; ++x) {
        float sum = kTaps[kMiddle] * in[x];
        for (std::size_t i = 1; i <= std::size_t{kReach}; ++i) {
          const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(i) * stride;
          sum += kTaps[kMiddle + i] * in[x + offset] + kTaps[kMiddle - i] * in[x - offset];
        }
        out[x] = sum;
      }
    }
  }
  return to;
}

/// One part of the gradient of each voxel.
struct Parts {
  Field x, y, z;
  float scale;
  [[nodiscard]] glm::vec3 at(std::size_t i) const {
    return scale * glm::vec3(x.values[i], y.values[i], z.values[i]);
  }
};

template <GradientFilter kKind>
Parts parts_of(const VoxelGrid& grid, std::span<const Density> density, const VoxelBox& box) {
  Field all = padded(grid, density, box.grown(gradient_reach(kKind)));
  Field slope_x = filtered<kKind, true, 0>(all);
  Field smooth_x = filtered<kKind, false, 0>(all);
  Field slope_x_smooth_y = filtered<kKind, false, 1>(slope_x);
  Field slope_y = filtered<kKind, true, 1>(smooth_x);
  Field smooth_xy = filtered<kKind, false, 1>(smooth_x);
  return {filtered<kKind, false, 2>(slope_x_smooth_y), filtered<kKind, false, 2>(slope_y),
          filtered<kKind, true, 2>(smooth_xy), 1.0F / gradient_taps(kKind).divisor};
}

/// The direction of `wide` where it hardly differs from that of `narrow`: steps of voxels turn the
/// narrow one by 9 degrees at 99 of 100 points and the wide one by 2, an edge turns one farther.
/// Length and all else is the narrow one's.
glm::vec3 adapted(const glm::vec3& narrow, const glm::vec3& wide) {
  constexpr float kAgree = 0.985F, kDiffer = 0.940F;  // cosines of 10 and 20 degrees
  const float narrow_2 = glm::dot(narrow, narrow), wide_2 = glm::dot(wide, wide);
  if (!(narrow_2 > 0.0F && wide_2 > 0.0F)) return narrow;
  const float cosine = glm::dot(narrow, wide) / std::sqrt(narrow_2 * wide_2);
  const float part = std::clamp((cosine - kDiffer) / (kAgree - kDiffer), 0.0F, 1.0F);
  if (part == 0.0F) return narrow;
  const float length = std::sqrt(narrow_2);
  const glm::vec3 mixed = glm::mix(narrow, wide * (length / std::sqrt(wide_2)), part);
  return mixed * (length / std::sqrt(glm::dot(mixed, mixed)));
}

template <GradientFilter kKind, class Put>
void fill(const VoxelGrid& grid, std::span<const Density> density, const VoxelBox& box,
          const Put& put) {
  const Parts parts = parts_of<kKind>(grid, density, box);
  const std::size_t count = parts.x.values.size();
  if constexpr (kKind == GradientFilter::adaptive) {
    const Parts narrow = parts_of<GradientFilter::farid5>(grid, density, box);
    for (std::size_t i = 0; i < count; ++i) put(i, adapted(narrow.at(i), parts.at(i)));
  } else {
    for (std::size_t i = 0; i < count; ++i) put(i, parts.at(i));
  }
}

/// Whether all voxels of a box are alike, with air around the volume.
bool is_flat(const VoxelGrid& grid, std::span<const Density> density, const VoxelBox& box) {
  const VoxelBox inside = box.clipped(grid.box());
  const Density first = density[grid.index(inside.lo.x, inside.lo.y, inside.lo.z)];
  if (inside != box && first != 0) return false;
  for (std::int32_t z = inside.lo.z; z < inside.hi.z; ++z) {
    for (std::int32_t y = inside.lo.y; y < inside.hi.y; ++y) {
      const Density* const row = density.data() + grid.index(inside.lo.x, y, z);
      const Density* const end = row + (inside.hi.x - inside.lo.x);
      if (std::any_of(row, end, [&](Density d) { return d != first; })) return false;
    }
  }
  return true;
}

/// Block by block: most of a volume is air, or solid, and has none.
template <GradientFilter kKind>
void fill(const VoxelGrid& grid, std::span<const Density> density, const VoxelBox& box,
          std::vector<glm::vec3>& gradients) {
  constexpr std::int32_t kEdge = 16;
  const VoxelIndex n = box.extent();
  const VoxelGrid of_box{n.x, n.y, n.z};
  gradients.assign(of_box.voxel_count(), glm::vec3(0.0F));
  const VoxelBox blocks{
      {0, 0, 0}, {(n.x + kEdge - 1) / kEdge, (n.y + kEdge - 1) / kEdge, (n.z + kEdge - 1) / kEdge}};
  for_each_voxel(blocks, [&](int i, int j, int k) {
    const VoxelIndex lo{i * kEdge, j * kEdge, k * kEdge};
    const VoxelBox part = VoxelBox{lo, {lo.x + kEdge, lo.y + kEdge, lo.z + kEdge}}.clipped(
        {{0, 0, 0}, {n.x, n.y, n.z}});
    const VoxelBox voxels = part.moved(box.lo);
    if (is_flat(grid, density, voxels.grown(gradient_reach(kKind)))) return;
    const VoxelIndex m = part.extent();
    fill<kKind>(grid, density, voxels, [&](std::size_t at, const glm::vec3& gradient) {
      const auto index = static_cast<std::int32_t>(at);
      gradients[of_box.index(lo.x + index % m.x, lo.y + index / m.x % m.y,
                             lo.z + index / m.x / m.y)] = gradient;
    });
  });
}

}  // namespace

GradientFilter gradient_named(std::string_view name) {
  const auto found = std::find(kGradientNames.begin(), kGradientNames.end(), name);
  if (found != kGradientNames.end()) {
    return static_cast<GradientFilter>(found - kGradientNames.begin());
  }
  throw VisualizerError("--gradient: " + std::string(name) + unknown_word(name, kGradientNames));
}

void fill_gradients(GradientFilter kind, const VoxelGrid& grid, std::span<const Density> density,
                    const VoxelBox& box, std::vector<glm::vec3>& gradients) {
  switch (kind) {
    case GradientFilter::central:
      return fill<GradientFilter::central>(grid, density, box, gradients);
    case GradientFilter::corners:
      return fill<GradientFilter::corners>(grid, density, box, gradients);
    case GradientFilter::farid5:
      return fill<GradientFilter::farid5>(grid, density, box, gradients);
    case GradientFilter::adaptive:
      return fill<GradientFilter::adaptive>(grid, density, box, gradients);
  }
}

}  // namespace kerf
