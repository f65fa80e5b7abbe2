// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/mesh_rims.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

#include "shared/numeric/vec3.hpp"

namespace kerf {
namespace {

using Point = ToolMesh::Point;
using vec3::doubled_area, vec3::dot, vec3::length, vec3::unit;
using vec3::operator+, vec3::operator-, vec3::operator*;

// Between two samples a pitch apart an edge of angle t stands 1/2 tan(t / 2) pitches above both.
// That may be 0.04 units, what a wedged tool may be deep (SweepRules::kWedged) less the tolerance.
// The same holds for a row of samples along a rim that bends.
const double kSharp = 2 * std::atan(2 * 0.04);
const double kCosRim = std::cos(kSharp);
const double kStraight = 2 * std::sin(kSharp / 2);  // sum of two unit vectors that part by it
constexpr double kPointShare = 0.05;  // of the full angle, that a point lacks at least
// Pitches from a rim into both faces, and from a point along each of its rims. Tuned: on tilted
// planes a cylinder of 48 sides and a square bar then rest within 0.01 voxels of the ideal in the
// mean and 0.07 at most. On the rims and points themselves a bar rests 0.06 too high in the mean;
// twice as far from a rim one that lies on an edge is 0.075 too low.
constexpr double kFromRim = 0.015, kFromPoint = 0.04;
constexpr double kNearest = 0.6;  // pitches

struct Face {
  Point normal;    // of length 1, or zero
  Point opposite;  // corner that is not on the edge
};

struct Rim {
  std::uint32_t a, b;
  Point inward;  // across the edge into both faces, the sum of two unit vectors
};

/// Across the edge from a to b, into the face.
Point inward_of(const Point& a, const Point& b, const Face& face) {
  const Point along = unit(b - a), to = face.opposite - a;
  return unit(to - dot(along, to) * along);
}

std::vector<Rim> rims_of(const ToolMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Face>> edges;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const Point normal = unit(doubled_area(mesh.corners(t)));
    for (std::size_t k = 0; k < 3; ++k) {
      edges[std::minmax(t[k], t[(k + 1) % 3])].push_back({normal, mesh.points_mm[t[(k + 2) % 3]]});
    }
  }
  std::vector<Rim> rims;
  for (const auto& [edge, faces] : edges) {
    if (faces.size() != 2) continue;
    const Point &a = mesh.points_mm[edge.first], &b = mesh.points_mm[edge.second];
    if (dot(faces[0].normal, faces[1].normal) > kCosRim) continue;
    const Point into = inward_of(a, b, faces[1]);
    if (dot(faces[0].normal, into) >= 0) continue;  // a groove
    rims.push_back({edge.first, edge.second, inward_of(a, b, faces[0]) + into});
  }
  return rims;
}

/// Which corners lack so much of the full angle that they are points.
std::vector<bool> points_of(const ToolMesh& mesh) {
  std::vector<double> angle(mesh.points_mm.size());
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto corner = mesh.corners(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const Point u = unit(corner[(k + 1) % 3] - corner[k]);
      const Point v = unit(corner[(k + 2) % 3] - corner[k]);
      angle[t[k]] += std::acos(std::clamp(dot(u, v), -1.0, 1.0));
    }
  }
  std::vector<bool> is_point(angle.size());
  for (std::size_t i = 0; i < angle.size(); ++i) {
    is_point[i] = angle[i] < 2 * std::numbers::pi * (1 - kPointShare);
  }
  return is_point;
}

/// Samples of which none is too near to another.
class ApartSamples {
 public:
  explicit ApartSamples(double apart_mm) : apart_mm_(apart_mm) {}

  void add(const Point& p) {
    const Cell at = cell_of(p);
    Cell cell{};
    for (cell[0] = at[0] - 1; cell[0] <= at[0] + 1; ++cell[0]) {
      for (cell[1] = at[1] - 1; cell[1] <= at[1] + 1; ++cell[1]) {
        for (cell[2] = at[2] - 1; cell[2] <= at[2] + 1; ++cell[2]) {
          // A cell is as wide as the distance; it holds few.
          const auto [begin, end] = cells_.equal_range(cell);
          for (auto near = begin; near != end; ++near) {
            if (length(samples_[near->second] - p) < apart_mm_) return;
          }
        }
      }
    }
    cells_.emplace(at, samples_.size());
    samples_.push_back(p);
  }

  [[nodiscard]] std::vector<Point> samples() && { return std::move(samples_); }

 private:
  using Cell = std::array<std::int64_t, 3>;

  [[nodiscard]] Cell cell_of(const Point& p) const {
    Cell cell{};
    for (std::size_t i = 0; i < 3; ++i)
      cell[i] = static_cast<std::int64_t>(std::floor(p[i] / apart_mm_));
    return cell;
  }

  double apart_mm_;
  std::vector<Point> samples_;
  std::multimap<Cell, std::size_t> cells_;
};

/// Rims in a row, from one end to the other or all round.
class RimRows {
 public:
  RimRows(const ToolMesh& mesh, const std::vector<Rim>& rims, const std::vector<bool>& is_end)
      : mesh_(mesh), rims_(rims), is_end_(is_end), at_(mesh.points_mm.size()), done_(rims.size()) {
    for (std::size_t r = 0; r < rims.size(); ++r) {
      at_[rims[r].a].push_back(r);
      at_[rims[r].b].push_back(r);
    }
  }

  void sample(double pitch_mm, ApartSamples& samples) {
    for (std::uint32_t corner = 0; corner < at_.size(); ++corner) {
      if (!is_end_[corner]) continue;
      for (const std::size_t r : at_[corner]) sample_row(corner, r, pitch_mm, samples);
    }
    for (std::size_t r = 0; r < rims_.size(); ++r) sample_row(rims_[r].a, r, pitch_mm, samples);
  }

 private:
  struct Step {
    std::uint32_t from, to;
    std::size_t rim;
  };

  /// All the way from a corner over one of its rims until an end, or back to where it began.
  std::vector<Step> row_from(std::uint32_t corner, std::size_t rim) {
    std::vector<Step> row;
    while (!done_[rim]) {
      done_[rim] = true;
      const std::uint32_t to = rims_[rim].a == corner ? rims_[rim].b : rims_[rim].a;
      row.push_back({corner, to, rim});
      if (is_end_[to]) break;
      rim = at_[to][0] == rim ? at_[to][1] : at_[to][0];
      corner = to;
    }
    return row;
  }

  [[nodiscard]] double length_of(const Step& step) const {
    return length(mesh_.points_mm[step.to] - mesh_.points_mm[step.from]);
  }

  /// Its ends have samples of their own.
  void sample_row(std::uint32_t corner, std::size_t rim, double pitch_mm, ApartSamples& samples) {
    const std::vector<Step> row = row_from(corner, rim);
    double length_mm = 0;
    for (const Step& step : row) length_mm += length_of(step);
    if (!(length_mm > 0)) return;
    const auto count = std::max(1.0, std::round(length_mm / pitch_mm));
    double next = is_end_[row.front().from] ? 1 : 0.5, passed_mm = 0;
    const double last = is_end_[row.front().from] ? count - 0.5 : count;
    for (const Step& step : row) {
      const double step_mm = length_of(step);
      for (; next < last && next * length_mm / count <= passed_mm + step_mm; ++next) {
        const double share = (next * length_mm / count - passed_mm) / step_mm;
        const Point &from = mesh_.points_mm[step.from], &to = mesh_.points_mm[step.to];
        const Point on = (1 - share) * from + share * to;
        samples.add(on + kFromRim * pitch_mm * rims_[step.rim].inward);
      }
      passed_mm += step_mm;
    }
  }

  const ToolMesh& mesh_;
  const std::vector<Rim>& rims_;
  const std::vector<bool>& is_end_;
  std::vector<std::vector<std::size_t>> at_;  // the rims that meet at a corner
  std::vector<bool> done_;
};

}  // namespace

std::vector<Point> rim_samples(const ToolMesh& mesh, double pitch_mm) {
  const std::vector<Rim> rims = rims_of(mesh);
  std::vector<int> meeting(mesh.points_mm.size());
  std::vector<Point> inward(mesh.points_mm.size());
  for (const Rim& rim : rims) {
    const Point direction = unit(mesh.points_mm[rim.b] - mesh.points_mm[rim.a]);
    ++meeting[rim.a];
    ++meeting[rim.b];
    inward[rim.a] = inward[rim.a] + direction;
    inward[rim.b] = inward[rim.b] - direction;
  }
  std::vector<bool> is_end = points_of(mesh);
  ApartSamples samples(kNearest * pitch_mm);
  for (std::size_t i = 0; i < is_end.size(); ++i) {
    const bool bends = length(inward[i]) > kStraight;
    is_end[i] = is_end[i] || (meeting[i] != 0 && (meeting[i] != 2 || bends));
    if (!is_end[i]) continue;
    samples.add(mesh.points_mm[i] + kFromPoint * pitch_mm * inward[i]);
  }
  RimRows(mesh, rims, is_end).sample(pitch_mm, samples);
  return std::move(samples).samples();
}

}  // namespace kerf
