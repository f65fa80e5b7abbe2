// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf {
namespace {

using vec3::cross, vec3::dot, vec3::length, vec3::operator+, vec3::operator-, vec3::operator*;

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // lower corner first

/// For each triangle the first one of its part; edges join triangles to parts.
std::vector<std::size_t> first_of_parts(const ToolMesh& mesh) {
  std::vector<std::size_t> next(mesh.triangles.size());  // toward the first of the part
  std::iota(next.begin(), next.end(), std::size_t{0});
  const auto first_of = [&](std::size_t t) {
    while (next[t] != t) t = next[t] = next[next[t]];
    return t;
  };
  std::map<Edge, std::size_t> known;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const ToolMesh::Triangle& triangle = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      const std::size_t a = first_of(known.try_emplace(edge, t).first->second), b = first_of(t);
      next[std::max(a, b)] = std::min(a, b);
    }
  }
  for (std::size_t t = 0; t < next.size(); ++t) next[t] = first_of(t);
  return next;
}

/// Triangles of a part and the box around them.
struct Part {
  std::vector<std::size_t> triangles;
  ToolMesh::Point low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  double volume_mm3 = 0;

  [[nodiscard]] bool box_holds(const ToolMesh::Point& p) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (p[axis] < low[axis] || p[axis] > high[axis]) return false;
    }
    return true;
  }
};

std::vector<Part> parts_of(const ToolMesh& mesh) {
  const std::vector<std::size_t> first = first_of_parts(mesh);
  std::vector<Part> by_first(first.size()), parts;
  for (std::size_t t = 0; t < first.size(); ++t) {
    Part& part = by_first[first[t]];
    part.triangles.push_back(t);
    const auto corners = mesh.corners(mesh.triangles[t]);
    for (const ToolMesh::Point& p : corners) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        part.low[axis] = std::min(part.low[axis], p[axis]);
        part.high[axis] = std::max(part.high[axis], p[axis]);
      }
    }
    part.volume_mm3 += dot(corners[0], cross(corners[1], corners[2])) / 6;
  }
  std::ranges::copy_if(by_first, std::back_inserter(parts),
                       [](const Part& part) { return !part.triangles.empty(); });
  return parts;
}

/// Winding number of a part around a position: the sum of the solid angles of its triangles (Van
/// Oosterom and Strackee 1983) over that of the sphere.
double winding(const ToolMesh& mesh, const Part& part, const ToolMesh::Point& at) {
  double half_angles = 0;
  for (const std::size_t t : part.triangles) {
    auto [a, b, c] = mesh.corners(mesh.triangles[t]);
    a = a - at, b = b - at, c = c - at;
    const double la = length(a), lb = length(b), lc = length(c);
    half_angles += arctangent(dot(a, cross(b, c)),
                              la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return half_angles / (2 * std::numbers::pi);
}

}  // namespace

double turn_outward(ToolMesh& mesh) {
  std::vector<Part> parts = parts_of(mesh);
  const auto sum_mm3 = [&] {
    return std::accumulate(parts.begin(), parts.end(), 0.0,
                           [](double sum, const Part& part) { return sum + part.volume_mm3; });
  };
  const auto turn = [&](Part& part) {
    for (const std::size_t t : part.triangles)
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    part.volume_mm3 = -part.volume_mm3;
  };
  // The sum of `of`(winding number) of the other parts around this one.
  const auto around = [&](const Part& part, auto of) {
    const ToolMesh::Point at = mesh.corners(mesh.triangles[part.triangles.front()])[0];
    double sum = 0;
    for (const Part& other : parts) {
      if (&other != &part && other.box_holds(at)) sum += of(winding(mesh, other, at));
    }
    return sum;
  };
  if (sum_mm3() < 0) std::ranges::for_each(parts, turn);
  std::vector<std::pair<double, Part*>> inside_out;  // by the number of parts that each lies in
  for (Part& part : parts) {
    if (part.volume_mm3 >= 0) continue;
    inside_out.emplace_back(around(part, [](double w) { return std::round(std::abs(w)); }), &part);
  }
  std::ranges::stable_sort(inside_out, {}, &std::pair<double, Part*>::first);
  for (const auto& [depth, part] : inside_out) {
    if (around(*part, [](double w) { return w; }) < 0.5) turn(*part);
  }
  return sum_mm3();
}

namespace {

/// Volume and its first and second moments about the origin.
struct Moments {
  double volume = 0;
  ToolMesh::Point first{};
  std::array<double, 9> second{};
};

/// Of the tetrahedra between the origin and each triangle: the integral of x_i x_j over one of
/// volume v is v / 20 times the sum of x_i x_j over all pairs of corners, equal ones twice.
Moments moments_of(const ToolMesh& mesh) {
  Moments all;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto corners = mesh.corners(t);
    const double volume = dot(corners[0], cross(corners[1], corners[2])) / 6;
    const ToolMesh::Point sum = corners[0] + corners[1] + corners[2];
    all.volume += volume;
    all.first = all.first + (volume / 4) * sum;
    for (std::size_t i = 0; i < 9; ++i) {
      double pairs = sum[i / 3] * sum[i % 3];
      for (const ToolMesh::Point& p : corners) pairs += p[i / 3] * p[i % 3];
      all.second[i] += volume / 20 * pairs;
    }
  }
  return all;
}

/// The axis about which a body is round, as far as its second moments show: two of their principal
/// values are alike, as with any body that a turn by 120 degrees or less maps onto itself, and the
/// third differs. Zero if there is none.
///
/// With the deviator D of moments p, p, q: D = (q - p) (a a^T - I / 3), J2 = tr(D^2) / 2 =
/// (q - p)^2 / 3, det D = 2 (q - p)^3 / 27, and for other moments the determinant is smaller.
ToolMesh::Point round_axis(const Moments& all, const ToolMesh::Point& middle) {
  std::array<double, 9> d{};
  for (std::size_t i = 0; i < 9; ++i)
    d[i] = all.second[i] / all.volume - middle[i / 3] * middle[i % 3];
  const double mean = (d[0] + d[4] + d[8]) / 3;
  for (std::size_t i = 0; i < 9; i += 4) d[i] -= mean;
  double j2 = 0;
  for (const double x : d) j2 += x * x / 2;
  const double det =
      dot(ToolMesh::Point{d[0], d[1], d[2]},
          cross(ToolMesh::Point{d[3], d[4], d[5]}, ToolMesh::Point{d[6], d[7], d[8]}));
  const double apart = std::copysign(std::sqrt(3 * j2), det);  // q - p
  constexpr double kAlike = 0.95, kDiffers = 0.3;
  if (!(std::abs(apart) > kDiffers * mean)) return {};
  if (!(std::abs(det) > kAlike * 2 / 27 * std::abs(apart * apart * apart))) return {};
  std::size_t longest = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (d[4 * i] / apart > d[4 * longest] / apart) longest = i;
  }
  ToolMesh::Point axis{d[longest] / apart, d[3 + longest] / apart, d[6 + longest] / apart};
  axis[longest] += 1.0 / 3;
  return (1 / length(axis)) * axis;
}

std::string shown(const ToolMesh::Point& p) {
  const auto text = [](double x) { return short_text(std::round(100 * x) / 100 + 0.0); };
  return "(" + text(p[0]) + ", " + text(p[1]) + ", " + text(p[2]) + ")";
}

}  // namespace

std::string mesh_note(const ToolMesh& mesh) {
  std::vector<std::string> found;
  const std::vector<Part> parts = parts_of(mesh);
  if (parts.size() > 1) {
    const auto least = std::ranges::min_element(
        parts, {}, [](const Part& part) { return std::abs(part.volume_mm3); });
    found.push_back("its mesh is " + std::to_string(parts.size()) +
                    " closed shells without a common edge, the smallest from " + shown(least->low) +
                    " to " + shown(least->high) +
                    " mm; if one tool is meant, join them or leave one out");
  }
  const Moments all = moments_of(mesh);
  const ToolMesh::Point middle = (1 / all.volume) * all.first;
  const ToolMesh::Point axis = round_axis(all, middle);
  constexpr double kTurned = 0.9962;  // cos 5 degrees
  if (length(axis) > 0 && std::abs(axis[1]) < kTurned) {
    found.push_back("it is round about " + shown(axis) +
                    ", and the spindle turns about y; turn the mesh, a bur along z by -90 degrees "
                    "about x");
  }
  double radius_mm = 0;
  for (const ToolMesh::Point& p : mesh.points_mm)
    radius_mm = std::max(radius_mm, hypotenuse(p[0], p[2]));
  const double aside_mm = hypotenuse(middle[0], middle[2]);
  constexpr double kAside = 0.1;
  if (aside_mm > kAside * radius_mm) {
    found.push_back("its middle is " + short_text(std::round(1000 * aside_mm) / 1000) +
                    " mm beside the spindle's axis, x = z = 0; move the mesh");
  }
  std::string note;
  for (const std::string& sentence : found) note += (note.empty() ? "" : "; ") + sentence;
  return note;
}

}  // namespace kerf
