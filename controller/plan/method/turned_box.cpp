// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/turned_box.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <span>
#include <tuple>

#include "controller/plan/method/lattice.hpp"

namespace kerf {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;

/// Along one axis: floors at both ends, so a span of E voxels may reach one cell more than E + 1.
std::int32_t cells_of(double span_vox) {
  constexpr double kRounding = 1e-6;  // of the steps: it must not lose a cell
  return static_cast<std::int32_t>(std::floor(span_vox + kRounding)) + 2;
}

/// E by the angle between the tool's axis and the box's, in pitches.
class Spans {
 public:
  explicit Spans(std::span<const ToolOffset> offsets) {
    std::map<double, double> rings;  // radius by height
    double widest = 0;
    for (const ToolOffset& offset : offsets) {  // half pitches
      double& radius = rings[offset[1] / 2.0];
      radius = std::max(radius, std::hypot(offset[0] / 2.0, offset[2] / 2.0));
      widest = std::max(widest, radius);
    }
    if (rings.empty()) return;
    diameter_ = std::hypot(rings.rbegin()->first - rings.begin()->first, 2 * widest);
    for (std::size_t i = 0; i < by_angle_.size(); ++i) {
      const double angle = static_cast<double>(i) * kStep;
      double up = -1e9, down = -1e9;
      for (const auto& [height, radius] : rings) {
        up = std::max(up, height * std::cos(angle) + radius * std::sin(angle));
        down = std::max(down, -height * std::cos(angle) + radius * std::sin(angle));
      }
      by_angle_[i] = up + down;
    }
  }

  /// At most, for all angles that are not farther than `slack` from the one of this cosine, 0..1.
  [[nodiscard]] double most(double cosine, double slack) const {
    const double angle = std::acos(std::clamp(cosine, 0.0, 1.0));
    const auto nearest = static_cast<std::size_t>(std::lround(angle / kStep));
    return by_angle_[nearest] + diameter_ * (slack + kStep / 2);
  }

 private:
  static constexpr std::size_t kAngles = 1024;
  static constexpr double kStep = kRightAngle / kAngles;
  std::array<double, kAngles + 1> by_angle_{};
  double diameter_ = 0;
};

}  // namespace

std::vector<VoxelIndex> box_sizes(const SceneTool& tool, const SceneVolume& volume) {
  if (tool.round || !tool.turns) {
    const Matrix steps = unturned_steps(tool, volume);
    std::array<double, 3> edge{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) edge[i] += std::abs(steps[i][j]) * (tool.size_vox[j] - 1);
    }
    return {{cells_of(edge[0]), cells_of(edge[1]), cells_of(edge[2])}};
  }
  constexpr int kDirections = 96;  // along each angle of the octant that stands for all
  constexpr double kStep = kRightAngle / kDirections;
  const double slack = kStep * std::numbers::sqrt2 / 2;
  const Spans spans(tool.offsets);
  std::vector<VoxelIndex> sizes;
  for (int i = 0; i < kDirections; ++i) {
    const double polar = (i + 0.5) * kStep;
    for (int j = 0; j < kDirections; ++j) {
      const double around = (j + 0.5) * kStep;
      const auto cells = [&](std::size_t axis, double cosine) {
        return cells_of(spans.most(cosine, slack) * tool.pitch_mm / volume.image.spacing_mm[axis]);
      };
      sizes.push_back({cells(0, std::sin(polar) * std::cos(around)),
                       cells(1, std::sin(polar) * std::sin(around)), cells(2, std::cos(polar))});
    }
  }
  const auto key = [](const VoxelIndex& v) { return std::tuple(v.x, v.y, v.z); };
  std::ranges::sort(sizes, {}, key);
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  return sizes;
}

}  // namespace kerf
