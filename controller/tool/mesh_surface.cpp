// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf {
namespace {

using Point = ToolMesh::Point;
using vec3::doubled_area, vec3::dot, vec3::length, vec3::unit;
using vec3::operator+, vec3::operator-, vec3::operator*;

// Rims and points.

// Between two samples a pitch apart an edge of angle t rises 1/2 tan(t / 2) pitches above both.
// That may be 0.04 units, the depth of a wedged tool (SweepRules::kWedged) less the tolerance.
// That angle is a rim's for a row of samples, too, along a bent rim.
const double kSharp = 2 * arctangent(2 * 0.04, 1);
const double kCosRim = cosine(kSharp);
const double kStraight = 2 * sine(kSharp / 2);  // sum of two unit vectors that part by it
constexpr double kPointShare = 0.05;            // of the full angle, that a point lacks at least
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

/// Whether a corner lacks so much of the full angle that it is a point.
std::vector<bool> points_of(const ToolMesh& mesh) {
  std::vector<double> angle(mesh.points_mm.size());
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto corner = mesh.corners(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const Point u = unit(corner[(k + 1) % 3] - corner[k]);
      const Point v = unit(corner[(k + 2) % 3] - corner[k]);
      angle[t[k]] += arccosine(std::clamp(dot(u, v), -1.0, 1.0));
    }
  }
  std::vector<bool> is_point(angle.size());
  for (std::size_t i = 0; i < angle.size(); ++i) {
    is_point[i] = angle[i] < 2 * std::numbers::pi * (1 - kPointShare);
  }
  return is_point;
}

/// Samples that keep a distance from each other.
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

/// Rims joined to rows, from one end to the other or all round.
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

  /// The row from a corner over one of its rims to an end, or back to its begin.
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

  /// Samples a row without its ends, which have samples of their own.
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
  std::vector<std::vector<std::size_t>> at_;  // the rims at each corner
  std::vector<bool> done_;
};

/// Samples of the sharp features of a mesh: one on each point, and rows along its rims, one every
/// `pitch_mm` or nearly so. They lie a little inside of the rim. None is nearer to another than 0.6
/// of that, so that a rough surface gets no more than a smooth one.
///
/// A rim is an edge that sticks out by more than 9.2 degrees between its faces: a lathe of 40 sides
/// and more is round. A point is a corner that lacks more than a twentieth of the full angle, or in
/// which a rim bends or ends.
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

// The samples of the whole surface.

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// A position on the surface.
struct Dot {
  Point at, normal;
};

/// A sample; one of a rim belongs to all faces and is not moved.
struct Site {
  Point at, normal;
  bool rim;
};

double squared_distance(const Point& a, const Point& b) {
  const Point d = a - b;
  return dot(d, d);
}

/// Dots spread evenly over the area: so many in all, within each triangle by an additive sequence.
std::vector<Dot> spread_dots(const ToolMesh& mesh, std::size_t count) {
  // Fractions of the plastic number, the golden section of two dimensions (Roberts 2018).
  constexpr double kFirst = 0.7548776662466927, kSecond = 0.5698402909980532;
  const double step_mm2 = surface_mm2(mesh) / static_cast<double>(count);
  std::vector<Dot> dots;
  double passed_mm2 = 0, u = 0.5, v = 0.5;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto corner = mesh.corners(t);
    const Point doubled = doubled_area(corner);
    passed_mm2 += length(doubled) / 2;
    for (; (static_cast<double>(dots.size()) + 0.5) * step_mm2 < passed_mm2;) {
      u += kFirst - std::floor(u + kFirst);
      v += kSecond - std::floor(v + kSecond);
      const bool beyond = u + v > 1;
      const double b = beyond ? 1 - u : u, c = beyond ? 1 - v : v;
      dots.push_back(
          {corner[0] + (b * (corner[1] - corner[0]) + c * (corner[2] - corner[0])), unit(doubled)});
    }
  }
  return dots;
}

/// The sites in cells of a grid, so that few are searched for the nearest.
class SiteGrid {
 public:
  SiteGrid(std::span<const Site> sites, double cell_mm) : sites_(sites) {
    Point high = low_ = sites.front().at;
    for (const Site& site : sites) {
      for (std::size_t i = 0; i < 3; ++i) {
        low_[i] = std::min(low_[i], site.at[i]);
        high[i] = std::max(high[i], site.at[i]);
      }
    }
    constexpr double kMostCells = 100;  // along an axis
    for (std::size_t i = 0; i < 3; ++i)
      cell_mm = std::max(cell_mm, (high[i] - low_[i]) / kMostCells);
    cell_mm_ = cell_mm;
    for (std::size_t i = 0; i < 3; ++i)
      size_[i] = static_cast<int>((high[i] - low_[i]) / cell_mm) + 1;
    first_.resize(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
                      static_cast<std::size_t>(size_[2]) +
                  1);
    for (const Site& site : sites) ++first_[index_of(cell_of(site.at)) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    order_.resize(sites.size());
    for (std::size_t s = 0; s < sites.size(); ++s)
      order_[next[index_of(cell_of(sites[s].at))]++] = s;
  }

  /// The nearest site that faces the same way as a dot; kNone if the cells around it have none.
  [[nodiscard]] std::size_t nearest(const Dot& dot) const {
    const std::array<int, 3> at = cell_of(dot.at);
    std::size_t best = kNone;
    double least = std::numeric_limits<double>::max();
    const auto from = [&](std::size_t i) { return std::max(0, at[i] - 1); };
    const auto to = [&](std::size_t i) { return std::min(size_[i] - 1, at[i] + 1); };
    for (int z = from(2); z <= to(2); ++z) {
      for (int y = from(1); y <= to(1); ++y) {
        // The cells of a row lie one after the other.
        const std::size_t end = first_[index_of({to(0), y, z}) + 1];
        for (std::size_t k = first_[index_of({from(0), y, z})]; k < end; ++k) {
          const Site& site = sites_[order_[k]];
          const double square = squared_distance(site.at, dot.at);
          if (square >= least || !(site.rim || vec3::dot(site.normal, dot.normal) > 0.1)) continue;
          least = square;
          best = order_[k];
        }
      }
    }
    return best;
  }

 private:
  [[nodiscard]] std::array<int, 3> cell_of(const Point& p) const {
    std::array<int, 3> cell{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double at = std::clamp((p[i] - low_[i]) / cell_mm_, 0.0, size_[i] - 1.0);
      cell[i] = static_cast<int>(at);
    }
    return cell;
  }
  [[nodiscard]] std::size_t index_of(const std::array<int, 3>& cell) const {
    std::size_t index = 0;
    for (std::size_t i = 3; i-- > 0;) {
      index = index * static_cast<std::size_t>(size_[i]) + static_cast<std::size_t>(cell[i]);
    }
    return index;
  }

  std::span<const Site> sites_;
  Point low_;
  double cell_mm_;
  std::array<int, 3> size_{};
  std::vector<std::size_t> first_, order_;
};

/// One site for each of `count` parts of as many dots, halved across the longest side.
void begin_sites(std::span<Dot> dots, std::size_t count, std::vector<Site>& sites) {
  if (dots.empty() || count == 0) return;
  if (count == 1) {
    const Dot& middle = dots[dots.size() / 2];
    sites.push_back({middle.at, middle.normal, false});
    return;
  }
  Point low = dots.front().at, high = low;
  for (const Dot& dot : dots) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], dot.at[i]);
      high[i] = std::max(high[i], dot.at[i]);
    }
  }
  const Point side = high - low;
  const auto widest =
      static_cast<std::size_t>(std::max_element(side.begin(), side.end()) - side.begin());
  const std::size_t half = dots.size() * (count / 2) / count;
  // Stable, as every order here: standard libraries part equal dots in different ways.
  std::stable_sort(dots.begin(), dots.end(),
                   [widest](const Dot& a, const Dot& b) { return a.at[widest] < b.at[widest]; });
  begin_sites(dots.first(half), count / 2, sites);
  begin_sites(dots.subspan(half), count - count / 2, sites);
}

/// The side of a cube with the most similar normal.
int facing(const Point& normal) {
  int widest = 0;
  for (int i = 1; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i), best = static_cast<std::size_t>(widest);
    if (std::abs(normal[axis]) > std::abs(normal[best])) widest = i;
  }
  return 2 * widest + (normal[static_cast<std::size_t>(widest)] < 0 ? 1 : 0);
}

/// Begins sites on each side of the mesh alone, so that both faces of a thin one get their part.
void begin_sites_by_side(std::span<Dot> dots, std::size_t count, std::vector<Site>& sites) {
  const std::size_t all = dots.size(), known = sites.size();
  auto rest = dots.begin();
  for (int side = 0; side < 6; ++side) {
    const auto end = std::stable_partition(
        rest, dots.end(), [side](const Dot& dot) { return facing(dot.normal) == side; });
    if (rest == end) continue;
    const auto passed = static_cast<std::size_t>(end - dots.begin());
    begin_sites({rest, end}, passed * count / all - (sites.size() - known), sites);
    rest = end;
  }
}

/// Lloyd's step: moves each site to the middle of its dots, then back to the surface.
void relax(std::span<const Dot> dots, double distance_mm, std::vector<Site>& sites) {
  const SiteGrid grid(sites, distance_mm);
  std::vector<std::size_t> owner(dots.size());
  std::vector<Point> sum(sites.size());
  std::vector<double> count(sites.size()), least(sites.size(), std::numeric_limits<double>::max());
  for (std::size_t d = 0; d < dots.size(); ++d) {
    owner[d] = grid.nearest(dots[d]);
    if (owner[d] == kNone) continue;
    sum[owner[d]] = sum[owner[d]] + dots[d].at;
    ++count[owner[d]];
  }
  for (std::size_t d = 0; d < dots.size(); ++d) {
    const std::size_t s = owner[d];
    if (s == kNone || sites[s].rim) continue;
    const Point middle = 1 / count[s] * sum[s];
    const double square = squared_distance(dots[d].at, middle);
    if (square >= least[s]) continue;
    least[s] = square;
    // Onto the plane of the dot that is nearest to the middle.
    const Point& normal = dots[d].normal;
    const double above = dot(middle - dots[d].at, normal);
    sites[s].at = middle - above * normal;
    sites[s].normal = normal;
  }
}

}  // namespace

double surface_mm2(const ToolMesh& mesh) {
  double sum = 0;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    sum += length(doubled_area(mesh.corners(t))) / 2;
  }
  return sum;
}

std::vector<SurfaceSample> mesh_surface_samples(const ToolMesh& mesh, std::size_t count,
                                                Relaxation relaxation) {
  const double distance_mm = std::sqrt(surface_mm2(mesh) / static_cast<double>(count));
  std::vector<Site> sites;
  for (const Point& p : rim_samples(mesh, distance_mm)) sites.push_back({p, {}, true});
  std::vector<Dot> dots = spread_dots(mesh, relaxation.dots * count);
  if (sites.size() < count) {
    // The others begin where no rim is near.
    auto beyond = dots.begin();
    if (!sites.empty()) {
      const SiteGrid rims(sites, distance_mm);
      beyond = std::stable_partition(dots.begin(), dots.end(), [&](const Dot& dot) {
        const std::size_t rim = rims.nearest(dot);
        return rim != kNone &&
               squared_distance(sites[rim].at, dot.at) < distance_mm * distance_mm / 4;
      });
    }
    begin_sites_by_side({beyond, dots.end()}, count - sites.size(), sites);
  }
  for (int i = 0; i < relaxation.rounds; ++i) relax(dots, distance_mm, sites);
  std::vector<SurfaceSample> samples;
  for (const Site& site : sites) samples.push_back({site.at, site.normal});
  return samples;
}

}  // namespace kerf
