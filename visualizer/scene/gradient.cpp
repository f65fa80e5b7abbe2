// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/gradient.hpp"

#include <algorithm>
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
  constexpr std::array<float, 5> kTaps = kSlope ? kBoth.slope : kBoth.smooth;
  constexpr int kReach = gradient_reach(kKind);
  constexpr std::size_t kMiddle = 2;
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

template <GradientFilter kKind>
void fill(const VoxelGrid& grid, std::span<const Density> density, const VoxelBox& box,
          std::vector<glm::vec3>& gradients) {
  Field all = padded(grid, density, box.grown(gradient_reach(kKind)));
  Field slope_x = filtered<kKind, true, 0>(all);
  Field smooth_x = filtered<kKind, false, 0>(all);
  Field slope_x_smooth_y = filtered<kKind, false, 1>(slope_x);
  Field slope_y = filtered<kKind, true, 1>(smooth_x);
  Field smooth_xy = filtered<kKind, false, 1>(smooth_x);
  const Field x = filtered<kKind, false, 2>(slope_x_smooth_y);
  const Field y = filtered<kKind, false, 2>(slope_y);
  const Field z = filtered<kKind, true, 2>(smooth_xy);
  constexpr float kScale = 1.0F / gradient_taps(kKind).divisor;
  gradients.resize(x.values.size());
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    gradients[i] = kScale * glm::vec3(x.values[i], y.values[i], z.values[i]);
  }
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
  }
}

}  // namespace kerf
