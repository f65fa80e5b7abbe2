// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/inner_samples.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf {
namespace {

/// Fraction of a voxel. With 0 a flame whose radius is a whole number of pitches never cuts deeper
/// (tests/servo/rim_cut_test.cpp).
constexpr double kLeastCovered = 1.0 / 16;

/// Indices along one axis: those within a pitch of a position, and the nearest, or both of two.
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

namespace {

using vec3::length;
using vec3::operator+, vec3::operator-, vec3::operator*;

// Coordinates in half pitches with so many fraction bits. A mesh reaches 2^7 half pitches at most,
// so products of differences are below 2^57.
constexpr int kBits = 20;
constexpr double kOne = 1 << kBits;
constexpr double kOnSurface = 1e-4;  // half pitches from a sample that still count as on it

/// Samples across (x and z) and along the head (y).
struct Grid {
  double across, along;
};

Grid grid_of(const ToolMesh& mesh, double pitch_mm) {
  double across_mm = 0, high_mm = 0;
  for (const auto& [x, y, z] : mesh.points_mm) {
    across_mm = std::max({across_mm, std::abs(x), std::abs(z)});
    high_mm = std::max(high_mm, y);
  }
  const double reach = std::floor(across_mm / pitch_mm * (1 + 1e-9));
  return {2 * reach + 1, std::max(1.0, std::round(2 * high_mm / pitch_mm))};
}

/// A corner in the view along y.
struct Seen {
  std::int64_t x, z;
  double y;
};

/// An infinitely small displacement, along z smaller than along x: a column moved by it meets no
/// edge.
struct Nudge {
  int x, z;
};

/// Side of the line from a to b on which the nudged column lies: above 0 is left.
std::int64_t side_of(const Seen& a, const Seen& b, std::int64_t x, std::int64_t z, Nudge nudge) {
  const std::int64_t side = (b.x - a.x) * (z - a.z) - (b.z - a.z) * (x - a.x);
  if (side != 0) return side;
  if (b.z != a.z) return (a.z - b.z) * nudge.x;
  return (b.x - a.x) * nudge.z;
}

/// The samples of a grid with a winding number above 0.
class Columns {
 public:
  Columns(std::int32_t across, std::int32_t along)
      : across_(across),
        along_(along),
        change_(static_cast<std::size_t>(across * across * (along + 1))),
        inside_(change_.size()) {}

  void keep(const std::vector<std::array<Seen, 3>>& triangles, Nudge nudge) {
    std::fill(change_.begin(), change_.end(), 0);
    for (const auto& triangle : triangles) pass(triangle, nudge);
    std::int32_t winding = 0;
    for (std::size_t i = 0; i < change_.size(); ++i) {  // each column sums up to 0
      winding += change_[i];
      if (winding > 0) inside_[i] = true;
    }
  }

  [[nodiscard]] bool inside(std::int32_t ix, std::int32_t iy, std::int32_t iz) const {
    return inside_[first_of(ix, iz) + static_cast<std::size_t>(iy)];
  }

 private:
  [[nodiscard]] std::size_t first_of(std::int32_t ix, std::int32_t iz) const {
    return (static_cast<std::size_t>(iz) * static_cast<std::size_t>(across_) +
            static_cast<std::size_t>(ix)) *
           (static_cast<std::size_t>(along_) + 1);
  }

  /// The columns of samples from `low` to `high`: first and one after the last.
  [[nodiscard]] std::array<std::int32_t, 2> columns(std::int64_t low, std::int64_t high) const {
    const double first = std::ceil((static_cast<double>(low) / kOne + across_ - 1) / 2);
    const double last = std::floor((static_cast<double>(high) / kOne + across_ - 1) / 2);
    return {static_cast<std::int32_t>(std::max(0.0, first)),
            static_cast<std::int32_t>(std::min(across_ - 1.0, last)) + 1};
  }

  void pass(const std::array<Seen, 3>& t, Nudge nudge) {
    const std::int64_t turn =
        (t[1].x - t[0].x) * (t[2].z - t[0].z) - (t[1].z - t[0].z) * (t[2].x - t[0].x);
    if (turn == 0) return;  // its axis is vertical
    const auto [xa, xb] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [za, zb] = std::minmax({t[0].z, t[1].z, t[2].z});
    const auto [x_first, x_end] = columns(xa, xb);
    const auto [z_first, z_end] = columns(za, zb);
    for (std::int32_t iz = z_first; iz < z_end; ++iz) {
      for (std::int32_t ix = x_first; ix < x_end; ++ix) {
        const std::int64_t x = std::int64_t{2 * ix + 1 - across_} << kBits;
        const std::int64_t z = std::int64_t{2 * iz + 1 - across_} << kBits;
        const std::int64_t to_a = side_of(t[1], t[2], x, z, nudge);
        const std::int64_t to_b = side_of(t[2], t[0], x, z, nudge);
        const std::int64_t to_c = side_of(t[0], t[1], x, z, nudge);
        if ((to_a > 0) != (turn > 0) || (to_b > 0) != (turn > 0) || (to_c > 0) != (turn > 0)) {
          continue;
        }
        meet(first_of(ix, iz), height_at(t, x, z), turn < 0);
      }
    }
  }

  /// Height of the triangle's plane at a column.
  static double height_at(const std::array<Seen, 3>& t, std::int64_t x, std::int64_t z) {
    constexpr Nudge kNone{0, 0};
    const auto a = static_cast<double>(side_of(t[1], t[2], x, z, kNone));
    const auto b = static_cast<double>(side_of(t[2], t[0], x, z, kNone));
    const auto c = static_cast<double>(side_of(t[0], t[1], x, z, kNone));
    return (a * t[0].y + b * t[1].y + c * t[2].y) / (a + b + c);
  }

  /// All samples below the surface are inside of one that faces up, and outside of one that faces
  /// down; those on it are inside.
  void meet(std::size_t column, double y, bool faces_up) {
    const double edge = y + (faces_up ? kOnSurface : -kOnSurface);
    const double below = std::ceil((edge + along_ - 1) / 2);
    const auto end = static_cast<std::size_t>(std::clamp(below, 0.0, double(along_)));
    const std::int32_t sign = faces_up ? 1 : -1;
    change_[column] += sign;
    change_[column + end] -= sign;
  }

  std::int32_t across_, along_;
  std::vector<std::int32_t> change_;  // of the winding number from one sample to the next
  std::vector<bool> inside_;
};

std::vector<std::array<Seen, 3>> seen_triangles(const ToolMesh& mesh, double half_pitch_mm) {
  std::vector<std::array<Seen, 3>> triangles;
  const auto seen = [&](const ToolMesh::Point& p) {
    return Seen{std::llround(p[0] / half_pitch_mm * kOne),
                std::llround(p[2] / half_pitch_mm * kOne), p[1] / half_pitch_mm};
  };
  triangles.reserve(mesh.triangles.size());
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto [a, b, c] = mesh.corners(t);
    triangles.push_back({seen(a), seen(b), seen(c)});
  }
  return triangles;
}

/// Covers positions of each triangle, at most half a pitch apart.
void cover_surface(const ToolMesh& mesh, double pitch_mm, SampleLattice& lattice) {
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto [a, b, c] = mesh.corners(t);
    const auto to_b = 1 / pitch_mm * (b - a), to_c = 1 / pitch_mm * (c - a);
    const double longest = std::max({length(to_b), length(to_c), length(to_c - to_b)});
    const int parts = std::max(1, static_cast<int>(std::ceil(2 * longest)));
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; j <= parts - i; ++j) {
        lattice.cover(1 / pitch_mm * a + double(i) / parts * to_b + double(j) / parts * to_c);
      }
    }
  }
}

}  // namespace

double mesh_side_vox(const ToolMesh& mesh, double pitch_mm) {
  const Grid grid = grid_of(mesh, pitch_mm);
  return std::max(grid.across, grid.along);
}

SceneTool make_mesh_tool(std::string name, ToolMesh mesh, double pitch_mm) {
  assert(mesh_side_vox(mesh, pitch_mm) <= kMaxToolSide);
  const Grid grid = grid_of(mesh, pitch_mm);
  const auto across = static_cast<std::int32_t>(grid.across);
  const auto along = static_cast<std::int32_t>(grid.along);

  SceneTool tool;
  tool.name = std::move(name);
  tool.shape = kMeshShape;
  tool.pitch_mm = pitch_mm;
  tool.radius_mm = 0;
  tool.length_mm = 0;
  for (const auto& [x, y, z] : mesh.points_mm) {
    tool.radius_mm = std::max(tool.radius_mm, hypotenuse(x, z));
    tool.length_mm = std::max(tool.length_mm, 2 * y);
  }
  tool.size_vox = {across, along, across};

  Columns columns(across, along);
  const auto triangles = seen_triangles(mesh, pitch_mm / 2);
  // A sample on the surface is inside after one of these: a face keeps its samples on either side.
  for (const Nudge nudge : {Nudge{1, 1}, Nudge{1, -1}, Nudge{-1, 1}, Nudge{-1, -1}}) {
    columns.keep(triangles, nudge);
  }
  SampleLattice lattice(across, along);
  bool any = false;
  for (std::int32_t y = 0; y < along; ++y) {
    for (std::int32_t z = 0; z < across; ++z) {
      for (std::int32_t x = 0; x < across; ++x) {
        if (!columns.inside(x, y, z)) continue;
        lattice.keep(x, y, z);
        any = true;
      }
    }
  }
  if (any) cover_surface(mesh, pitch_mm, lattice);
  tool.offsets = lattice.offsets();
  tool.mesh = std::move(mesh);
  return tool;
}

}  // namespace kerf
