// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "controller/kernel/proxy/tool_turn.hpp"
#include "tests/kernel/support.hpp"
#include "tests/proxy/points.hpp"

/// A tool of surface samples in a voxel volume, plain and in double: the contact that the sweep is
/// tried on. One unit is one voxel, the origin is the first voxel's centre.
namespace kerf::test {

/// A solid whose density rises from 0 to full over two voxels around its face (iso 0.5).
template <class Distance>
TestVolume blurred(VoxelGrid grid, Distance&& distance) {
  return solid(grid, [&](double x, double y, double z) { return distance(Point{x, y, z}) / 2; });
}

/// Fibonacci points: even, and on no grid line.
inline std::vector<Point> ball_shell(double radius, int count) {
  std::vector<Point> samples;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z);
    const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    samples.push_back({radius * r * std::cos(turn), radius * r * std::sin(turn), radius * z});
  }
  return samples;
}

/// A cylinder along y with flat ends, samples a voxel apart.
inline std::vector<Point> cylinder_shell(double radius, double half) {
  std::vector<Point> samples;
  const auto ring = [&](double r, double y, double offset) {
    const int count = std::max(1, int(std::ceil(2 * std::numbers::pi * r)));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * (i + offset) / count;
      samples.push_back({r * std::cos(angle), y, r * std::sin(angle)});
    }
  };
  const int rows = int(std::ceil(2 * half));
  for (int i = 0; i <= rows; ++i) ring(radius, -half + 2 * half * i / rows, 0.5 * (i % 2));
  for (int r = 0; r < int(radius); ++r) {
    ring(r, -half, 0);
    ring(r, half, 0);
  }
  return samples;
}

template <class N>
class ShellField {
 public:
  ShellField(const TestVolume& volume, std::vector<Point> samples, bool round)
      : volume_(volume), samples_(std::move(samples)), turned_(samples_), round_(round) {}

  /// contact.md 3: power sums over the samples, in double whatever the numbers of the solver.
  Probe<N> probe(ContactVec<typename N::Real> at) {
    ++probes;
    const Point q = point_of<N>(at);
    const int p = round_ ? 4 : 6;
    double s0 = 0, s1 = 0, s2 = 0;
    Point lever{}, rise{}, rise_low{};
    for (const Point& offset : turned_) {
      Point slope{};
      const double rho = density(q + offset, slope);
      if (rho < 1.0 / 16) continue;
      const double low = round_ ? rho * rho * rho : rho * rho * rho * rho * rho, w = low * rho;
      s0 += w;
      s1 += w * rho;
      s2 += w * rho * rho;
      lever = lever + w * offset;
      rise = rise + w * slope;
      rise_low = rise_low + low * slope;
    }
    Probe<N> probe;
    if (s0 <= 0) return probe;
    const double m = s1 / s0;
    double e = 1;
    if (!round_) {
      const double r = std::max(1.0, s2 / s0 / (m * m)), rest = p + 2 - r * (p + 1);
      e = rest > 1e-3 ? std::clamp((p + 1.0) * (p + 2.0) * (r - 1) / rest, 0.0, 2.0) : 2;
    }
    const double height = m * (p + 1 + e) / (p + 1);
    const Point climb = (1 + e / (p + 1)) / s0 * ((p + 1.0) * rise - p * m * rise_low);
    const double across = length(lever), uphill = length(climb);
    if (uphill < 1e-9 || (round_ && across < 1e-3 * s0)) {
      probe.buried = height > 0.9;
      return probe;
    }
    const Point gradient = -1 / uphill * climb;
    const Point normal = round_ ? lever_normal(-1 / across * lever, gradient) : gradient;
    const double slope = std::clamp(-dot(climb, normal), 0.2, 1.2);
    probe.count = 1;
    probe.depth = typename N::Real((height - 0.5) / slope);
    probe.plane[0] = {normal_of<N>(normal), probe.depth, place_of<N>(1 / s0 * lever)};
    return probe;
  }
  [[nodiscard]] typename N::Real free_distance(ContactVec<typename N::Real>) const {
    return typename N::Real(0);
  }
  void turn(const ToolTurn<N>& turn) {
    if (round_) return;
    const auto rows = rows_of(turn);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      for (std::size_t a = 0; a < 3; ++a) {
        turned_[i][a] = double(rows[a][0]) * samples_[i][0] + double(rows[a][1]) * samples_[i][1] +
                        double(rows[a][2]) * samples_[i][2];
      }
    }
  }

  long probes = 0;

 private:
  /// A ball's normal is that of its lever arms, which is smoother than any gradient. Where the tool
  /// lies in a groove of its own radius its levers point to the bottom, and out of there is the
  /// wrong way: from 30 degrees of difference on the gradient takes over, wholly at 60.
  static Point lever_normal(Point lever, Point gradient) {
    constexpr double kFrom = 0.8660254037844387, kTo = 0.5;  // cosines
    const double share = std::clamp((kFrom - dot(lever, gradient)) / (kFrom - kTo), 0.0, 1.0);
    return share > 0 ? unit(lever + share * (gradient - lever)) : lever;
  }
  double density(Point at, Point& slope) const {
    const VoxelGrid& grid = volume_.grid;
    const auto low = [](double x) { return static_cast<std::int32_t>(std::floor(x)); };
    const std::int32_t x = low(at[0]), y = low(at[1]), z = low(at[2]);
    if (x < 0 || y < 0 || z < 0 || x >= grid.nx - 1 || y >= grid.ny - 1 || z >= grid.nz - 1) {
      return 0;
    }
    const double a = at[0] - x, b = at[1] - y, c = at[2] - z;
    const std::size_t row = static_cast<std::size_t>(grid.nx),
                      layer = row * static_cast<std::size_t>(grid.ny);
    const Density* m = &volume_.density[grid.index(x, y, z)];
    const auto edge = [&](std::size_t i) { return m[i] + a * (m[i + 1] - m[i]); };
    const auto rise = [&](std::size_t i) { return double(m[i + 1] - m[i]); };
    const double e00 = edge(0), e10 = edge(row), e01 = edge(layer), e11 = edge(layer + row);
    const double f0 = e00 + b * (e10 - e00), f1 = e01 + b * (e11 - e01);
    const double r0 = rise(0) + b * (rise(row) - rise(0)),
                 r1 = rise(layer) + b * (rise(layer + row) - rise(layer));
    constexpr double kScale = 1.0 / kDensityMax;
    slope = kScale * Point{r0 + c * (r1 - r0), e10 - e00 + c * (e11 - e01 - e10 + e00), f1 - f0};
    return kScale * (f0 + c * (f1 - f0));
  }

  const TestVolume& volume_;
  std::vector<Point> samples_, turned_;
  bool round_;
};

}  // namespace kerf::test
