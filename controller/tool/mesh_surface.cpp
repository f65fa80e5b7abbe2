// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/mesh_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "controller/tool/mesh_rims.hpp"
#include "shared/numeric/vec3.hpp"

namespace kerf {
namespace {

using Point = ToolMesh::Point;
using vec3::doubled_area, vec3::dot, vec3::length, vec3::unit;
using vec3::operator+, vec3::operator-, vec3::operator*;

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// A place on the surface.
struct Dot {
  Point at, normal;
};

/// A sample; one of a rim belongs to all faces and stays where it is.
struct Site {
  Point at, normal;
  bool rim;
};

double squared_distance(const Point& a, const Point& b) {
  const Point d = a - b;
  return dot(d, d);
}

/// Even over the area: so many in all, within each triangle by an additive sequence.
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

/// The sites by cells of a grid, so that the nearest is found among few.
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

  /// The nearest site that a dot sees; kNone where there is none in the cells around it.
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
    return static_cast<std::size_t>((cell[2] * size_[1] + cell[1]) * size_[0] + cell[0]);
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
  std::nth_element(dots.begin(), dots.begin() + static_cast<std::ptrdiff_t>(half), dots.end(),
                   [widest](const Dot& a, const Dot& b) { return a.at[widest] < b.at[widest]; });
  begin_sites(dots.first(half), count / 2, sites);
  begin_sites(dots.subspan(half), count - count / 2, sites);
}

/// Which side of a cube looks the same way.
int facing(const Point& normal) {
  int widest = 0;
  for (int i = 1; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i), best = static_cast<std::size_t>(widest);
    if (std::abs(normal[axis]) > std::abs(normal[best])) widest = i;
  }
  return 2 * widest + (normal[static_cast<std::size_t>(widest)] < 0 ? 1 : 0);
}

/// The same for each side of the mesh alone, so that a thin one has its share on both faces.
void begin_sites_by_side(std::span<Dot> dots, std::size_t count, std::vector<Site>& sites) {
  const std::size_t all = dots.size(), known = sites.size();
  auto rest = dots.begin();
  for (int side = 0; side < 6; ++side) {
    const auto end = std::partition(rest, dots.end(),
                                    [side](const Dot& dot) { return facing(dot.normal) == side; });
    if (rest == end) continue;
    const auto passed = static_cast<std::size_t>(end - dots.begin());
    begin_sites({rest, end}, passed * count / all - (sites.size() - known), sites);
    rest = end;
  }
}

/// Lloyd's step: each site goes to the middle of its dots, then back to the surface.
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
      beyond = std::partition(dots.begin(), dots.end(), [&](const Dot& dot) {
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
