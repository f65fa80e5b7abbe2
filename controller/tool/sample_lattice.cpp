// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/sample_lattice.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

/// Of a voxel. With 0 a flame whose radius is a whole number of pitches stays where it is pressed
/// (tests/servo/rim_cut_test.cpp).
constexpr double kLeastCovered = 1.0 / 16;

/// Indices along one axis: those within a pitch of a place, and the nearest, or both of two.
struct Neighbours {
  std::int32_t from, to;  ///< the last one included
  std::int32_t nearest, as_near;
};

Neighbours neighbours(double at, std::int32_t side) {
  constexpr double kSame = 1e-9;
  const auto clamped = [&](double index) {
    return std::clamp(static_cast<std::int32_t>(index), 0, side - 1);
  };
  return {clamped(std::ceil(at - 1)), clamped(std::floor(at + 1)),
          clamped(std::ceil(at - 0.5 - kSame)), clamped(std::floor(at + 0.5 + kSame))};
}

}  // namespace

void SampleLattice::cover(const std::array<double, 3>& place) {
  const std::array<std::int32_t, 3> side{across_, along_, across_};
  std::array<double, 3> at{};
  std::array<Neighbours, 3> near{};
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = place[i] + (side[i] - 1) / 2.0;
    near[i] = neighbours(at[i], side[i]);
  }
  const auto weight = [&](std::size_t axis, std::int32_t index) {
    return std::max(0.0, 1 - std::abs(index - at[axis]));
  };
  double covered = 0;
  for (std::int32_t y = near[1].from; y <= near[1].to; ++y) {
    for (std::int32_t z = near[2].from; z <= near[2].to; ++z) {
      for (std::int32_t x = near[0].from; x <= near[0].to; ++x) {
        if (kept_[index(x, y, z)]) covered += weight(0, x) * weight(1, y) * weight(2, z);
      }
    }
  }
  if (covered >= kLeastCovered) return;
  for (const std::int32_t y : {near[1].nearest, near[1].as_near}) {
    for (const std::int32_t z : {near[2].nearest, near[2].as_near}) {
      for (const std::int32_t x : {near[0].nearest, near[0].as_near}) added_[index(x, y, z)] = true;
    }
  }
}

std::int32_t SampleLattice::taken_across() const {
  std::int32_t first = across_ / 2;
  for (std::int32_t y = 0; y < along_; ++y) {
    for (std::int32_t z = 0; z < across_; ++z) {
      for (std::int32_t x = 0; x < across_; ++x) {
        if (!has(x, y, z)) continue;
        first = std::min({first, x, z, across_ - 1 - x, across_ - 1 - z});
      }
    }
  }
  return across_ - 2 * first;
}

std::vector<ToolOffset> SampleLattice::offsets() const {
  std::vector<ToolOffset> offsets;
  const auto half_pitches = [](std::int32_t index, std::int32_t side) {
    return static_cast<std::int16_t>(2 * index + 1 - side);
  };
  for (std::int32_t y = 0; y < along_; ++y) {
    for (std::int32_t z = 0; z < across_; ++z) {
      for (std::int32_t x = 0; x < across_; ++x) {
        if (!has(x, y, z)) continue;
        offsets.push_back(
            {half_pitches(x, across_), half_pitches(y, along_), half_pitches(z, across_)});
      }
    }
  }
  return offsets;
}

}  // namespace kerf
