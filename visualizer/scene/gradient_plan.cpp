// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/gradient_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "shared/text/text.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

// Spreads of the filters for unequal voxels. The narrow one is as wide as farid5, in the longest
// edge. The wide one is as wide as that of cubes, in the shortest, and no less than the terraces of
// thick voxels need: of a ball that is nearly full or empty, with edges of 1 : 3, 1.4 leaves 4.4
// degrees at 99 of 100 points and 1.7 leaves 2.7.
constexpr double kNarrowPerLongest = 0.9;
constexpr double kWidePerShortest = 2.8;
constexpr double kWidePerLongest = 1.7;
constexpr double kCubic = 1.01;  // edges whose ratio is smaller count as equal
constexpr int kMostInCell =
    64;  // voxels along one axis; a cell's sum stays a whole number in 32 bits
/// Taps from `-reach` to `reach`.
AxisTaps axis_taps(std::span<const float> smooth, std::span<const float> slope) {
  AxisTaps taps;
  taps.reach = static_cast<std::int32_t>(smooth.size()) / 2;
  taps.smooth_sum = taps.slope_sum = 0.0F;
  const std::int32_t first = AxisTaps::kMiddle - taps.reach;
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    const std::int32_t at = static_cast<std::int32_t>(i) - taps.reach;
    const std::size_t place = static_cast<std::size_t>(first) + i;
    taps.smooth[place] = smooth[i];
    taps.slope[place] = slope[i];
    taps.smooth_sum += smooth[i];
    taps.slope_sum += static_cast<float>(at) * slope[i];
  }
  return taps;
}

AxisTaps central() {
  return axis_taps({{0, 1, 0}}, {{-1, 0, 1}});
}
AxisTaps corners() {
  return axis_taps({{1, 0, 1}}, {{-1, 0, 1}});
}
/// Farid and Simoncelli, "Differentiation of discrete multidimensional signals", IEEE Trans. Image
/// Processing 13(4), 2004; in the integers of the servo.
constexpr float kFaridSmooth[]{5, 32, 55, 32, 5}, kFaridSlope[]{-14, -35, 0, 35, 14};
AxisTaps farid5() {
  return axis_taps(kFaridSmooth, kFaridSlope);
}
/// Means over 5, 5 and 7 voxels, a quadratic spline whose spread is that of a Gaussian of 2.8.
/// Where a cut sphere is parallel to the voxels its steps are terraces sqrt(2 R) voxels long: 3, 5
/// and 5 leave 3.9 degrees of those of R = 28 at 99 of 100 points, this leaves 2.
constexpr float kWideSmooth[]{1, 3, 6, 10, 15, 19, 22, 23, 22, 19, 15, 10, 6, 3, 1};
constexpr float kWideSlope[]{-1, -2, -2, -2, -2, -2, -2, 0, 2, 2, 2, 2, 2, 2, 1};
AxisTaps wide15() {
  return axis_taps(kWideSmooth, kWideSlope);
}

/// The quadratic spline of a spread in cells, and its derivative: a spline whose knots are w apart
/// spreads by w / 2. Arithmetic alone, so that all machines have the same taps.
AxisTaps spline(double spread) {
  const double apart = 2.0 * spread;
  const int reach = std::clamp(static_cast<int>(std::ceil(1.5 * apart)) - 1, 1,
                               static_cast<int>(AxisTaps::kMiddle));
  std::vector<float> smooth, slope;
  for (int i = -reach; i <= reach; ++i) {
    const double at = std::abs(i / apart);
    const double rest = std::max(1.5 - at, 0.0);
    const double down = at < 0.5 ? 2.0 * at : rest;
    smooth.push_back(static_cast<float>(at < 0.5 ? 0.75 - at * at : 0.5 * rest * rest));
    slope.push_back(static_cast<float>(i < 0 ? -down : down));
  }
  return axis_taps(smooth, slope);
}

FilterTaps on_all_axes(const AxisTaps& taps) {
  return {taps, taps, taps};
}

FilterTaps voxel_taps(GradientFilter filter) {
  switch (filter) {
    case GradientFilter::central:
      return on_all_axes(central());
    case GradientFilter::corners:
      return on_all_axes(corners());
    case GradientFilter::farid5:
    case GradientFilter::adaptive:
      break;
  }
  return on_all_axes(farid5());
}

/// Standard deviation, in edges, of the smoothing whose derivative the slope is.
double spread_of(const AxisTaps& taps) {
  double third = 0.0;
  const float* const slope = taps.slope.data() + AxisTaps::kMiddle;
  for (std::int32_t i = -taps.reach; i <= taps.reach; ++i) {
    third += static_cast<double>(i * i * i) * static_cast<double>(slope[i]);
  }
  return std::sqrt(third / (3.0 * static_cast<double>(taps.slope_sum)));
}

/// `GradientPlan::surface_mm` in edges. A step that is blurred as a Gaussian blurs has the slope
/// 2 / (sqrt(2 pi) s) exp(-z^2 / (2 s^2)) over two edges; of s^2, 1/4 is the border's own.
double surface_depth(double spread) {
  const double s = std::hypot(spread, 0.5);
  const double steepest = 2.0 / (std::sqrt(2.0 * std::numbers::pi) * s);
  return s * std::sqrt(2.0 * std::log(std::max(steepest / kSurfaceSlope, 1.0)));
}

std::int32_t& part(VoxelIndex& index, int axis) {
  return axis == 0 ? index.x : axis == 1 ? index.y : index.z;
}

}  // namespace

GradientFilter gradient_named(std::string_view name) {
  const auto found = std::find(kGradientNames.begin(), kGradientNames.end(), name);
  if (found != kGradientNames.end()) {
    return static_cast<GradientFilter>(found - kGradientNames.begin());
  }
  throw VisualizerError("--gradient: " + std::string(name) + unknown_word(name, kGradientNames));
}

GradientPlan::GradientPlan(GradientFilter of, const glm::dvec3& edges_mm)
    : filter(of), voxel(voxel_taps(of)) {
  const double longest = std::max({edges_mm.x, edges_mm.y, edges_mm.z});
  surface_mm = surface_depth(spread_of(voxel.front())) * longest;
  if (filter != GradientFilter::adaptive) return;
  const double shortest = std::min({edges_mm.x, edges_mm.y, edges_mm.z});
  if (longest < kCubic * shortest) {
    narrow = voxel;
    wide = on_all_axes(wide15());
    surface_mm = surface_depth(spread_of(narrow.front())) * longest;
    return;
  }
  const double wide_mm = std::max(kWidePerShortest * shortest, kWidePerLongest * longest);
  surface_mm = surface_depth(kNarrowPerLongest) * longest;
  for (int axis = 0; axis < 3; ++axis) {
    // The hundredth is for edges that were rounded.
    const double fit = std::min(longest / edges_mm[axis] + 0.01, double{kMostInCell});
    const auto count = static_cast<std::int32_t>(fit);
    const double cell_mm = count * edges_mm[axis];
    part(cell, axis) = count;
    per_edge[axis] = static_cast<float>(edges_mm[axis] / longest);
    const auto i = static_cast<std::size_t>(axis);
    narrow[i] = spline(kNarrowPerLongest * longest / cell_mm);
    wide[i] = spline(wide_mm / cell_mm);
  }
}

VoxelIndex GradientPlan::reach() const noexcept {
  VoxelIndex most;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    VoxelIndex voxels = cell;
    const std::int32_t in_cell = part(voxels, axis);
    const std::int32_t cells = std::max(narrow[i].reach, wide[i].reach);
    // A voxel lies between the centres of two cells.
    const std::int32_t around = in_cell == 1 ? cells : in_cell * (cells + 1) + in_cell / 2;
    part(most, axis) = std::max(voxel[i].reach, around);
  }
  return most;
}

VoxelBox GradientPlan::around(const VoxelBox& box) const noexcept {
  return grown(box, reach());
}

namespace {

/// The boxes, two as one if that has at most 64^3 voxels and no more than they have together.
std::vector<VoxelBox> merged(const std::vector<VoxelBox>& all) {
  constexpr std::size_t kMostVoxels = std::size_t{64} * 64 * 64;
  constexpr std::ptrdiff_t kLookBack = 32;  // boxes: the bricks of two cuts take turns
  const auto voxels = [](const VoxelBox& box) {
    const VoxelIndex n = box.extent();
    return VoxelGrid{n.x, n.y, n.z}.voxel_count();
  };
  std::vector<VoxelBox> boxes;
  for (const VoxelBox& box : all) {
    const auto first = boxes.end() - std::min(kLookBack, std::ssize(boxes));
    const auto with = std::find_if(first, boxes.end(), [&](const VoxelBox& other) {
      const std::size_t together = voxels(box.united(other));
      return together <= kMostVoxels && together <= voxels(box) + voxels(other);
    });
    if (with != boxes.end()) {
      *with = with->united(box);
    } else {
      boxes.push_back(box);
    }
  }
  return boxes;
}

}  // namespace

std::vector<VoxelBox> GradientPlan::around(const ChangedBricks& changed,
                                           const BrickGrid& bricks) const {
  std::vector<VoxelBox> boxes;
  for (const ChangedBrick& brick : changed) {
    const VoxelBox box = ChangedBricks::bounds(brick, bricks);
    if (!box.empty()) boxes.push_back(around(box).clipped(bricks.grid.box()));
  }
  return merged(merged(boxes));  // layers of bricks, then all
}

}  // namespace kerf
