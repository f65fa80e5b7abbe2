// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/tool/inner_samples.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "shared/posix/program.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/rig/tool_meshes.hpp"
#include "tests/studies/contact/rows.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr VoxelGrid kGrid{44, 44, 44};
constexpr Point kMiddle{21, 21, 21};

enum class Pose { any, upright, lying };

/// Points of a tool's whole surface, 0.15 units apart at most, its corners and rims among them.
std::vector<Point> surface_points(const SceneTool& tool) {
  constexpr double kPitch = 0.15;
  std::vector<Point> points;
  const auto steps = [](double along) { return std::max(1, int(std::ceil(along / kPitch))); };
  for (const auto& triangle : tool.mesh.triangles) {
    const Point a = tool.mesh.points_mm[triangle[0]], ab = tool.mesh.points_mm[triangle[1]] - a,
                ac = tool.mesh.points_mm[triangle[2]] - a;
    const int n = steps(std::max({length(ab), length(ac), length(ac - ab)}));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n - i; ++j) {
        points.push_back(a + double(i) / n * ab + double(j) / n * ac);
      }
    }
  }
  if (!points.empty()) return points;
  const auto profile = tool_profile(tool, 512);
  for (std::size_t k = 1; k < profile.size(); ++k) {
    const auto &a = profile[k - 1], &b = profile[k];
    const int n = steps(std::hypot(b[0] - a[0], b[1] - a[1]));
    for (int i = 0; i <= n; ++i) {
      const double y = std::lerp(a[0], b[0], double(i) / n),
                   radius = std::lerp(a[1], b[1], double(i) / n);
      const int around = steps(2 * std::numbers::pi * radius);
      for (int j = 0; j < around; ++j) {
        const double angle = 2 * std::numbers::pi * j / around;
        points.push_back({radius * std::cos(angle), y, radius * std::sin(angle)});
      }
    }
  }
  return points;
}

/// How far along `out` from `centre` the points leave the trilinear density's iso-surface; below 0:
/// how far they are from it.
double depth_of(const Body& body, const std::vector<Point>& points, Point centre, Point out) {
  const DensityField field{body.grid, body.density.data(), density_scale(kIso), {}};
  const auto solid_at = [&](double along) {
    return std::ranges::any_of(points, [&](const Point& point) {
      const Point p = centre + along * out + point;
      const double place[3] = {p[0], p[1], p[2]};
      return point_sample<DoubleNumbers>(field, place).density > 0.5;
    });
  };
  double inside = -1, outside = 1;
  for (int step = 0; step < 14; ++step) {
    const double middle = (inside + outside) / 2;
    (solid_at(middle) ? inside : outside) = middle;
  }
  return (inside + outside) / 2;
}

}  // namespace

std::array<EdgedTool, 3> edged_tools() {
  return {{{"cylinder, any pose", tool_of_units("cylinder", 5, 16)},
           {"cone, any pose", tool_of_units("cone", 5, 16)},
           {"STL, square bar, any pose", mesh_of_units("bar", prism(6, 16, 4))}}};
}

SceneTool shipped_bur(double units_per_mm, double pitch) {
  const std::string file = find_data_file("scenes/burs/fluted.stl");
  return make_mesh_tool("bur", join_triangles(read_stl(file), units_per_mm, file), pitch);
}

void measure_shapes(const Effort& effort, const RowSink& add_row) {
  struct Subject {
    const char* name;
    SceneTool tool;
    Pose pose;
  };
  // 1.5 times the limits of a ball.
  constexpr double kOffset = 0.075, kOffsetAim = 0.03, kDegrees = 0.75, kDegreesAim = 0.45;
  for (const Subject& subject :
       {Subject{"cylinder, any pose", tool_of_units("cylinder", 5, 16), Pose::any},
        Subject{"cylinder on its end", tool_of_units("cylinder", 5, 16), Pose::upright},
        Subject{"cylinder on its side", tool_of_units("cylinder", 5, 16), Pose::lying},
        Subject{"cone, any pose", tool_of_units("cone", 5, 16), Pose::any},
        Subject{"inverted cone, any pose", tool_of_units("inverted_cone", 5, 10), Pose::any},
        Subject{"flame, any pose", tool_of_units("flame", 4, 16), Pose::any},
        Subject{"wheel, any pose", tool_of_units("wheel", 8, 4), Pose::any},
        Subject{"needle 2 voxels thick, any pose", tool_of_units("cylinder", 1, 16), Pose::any},
        Subject{"STL, square bar, any pose", mesh_of_units("bar", prism(6, 16, 4)), Pose::any},
        Subject{"STL, fluted bur, any pose", mesh_of_units("bur", fluted_bur(24)), Pose::any}}) {
    const Reach reach(subject.tool);
    const SampledTool tool(subject.tool);
    RandomNumbers random(8);
    double sum = 0, most = 0, degrees = 0;
    for (int k = 0; k < effort.tilts; ++k) {
      const Frame frame(random, kMiddle);
      const Point axis = subject.pose == Pose::upright ? frame.up
                         : subject.pose == Pose::lying ? frame.along
                                                       : random.direction();
      const Axes axes = standing_on(axis, random);
      const double support = reach.along(axes.to_tool(-1 * frame.up));
      const Body body = blurred(kGrid, [&](Point p) { return frame.of(p)[1] + support; });
      // From so high that the tool can turn first.
      const Point rest = rest_of<N>(tool, body, frame.place, frame.up, axes.orientation<N>(), 20);
      const double off = frame.of(rest)[1];
      sum += off;
      most = std::max(most, std::abs(off));
      degrees = std::max(degrees, degrees_between(rest - frame.at(0, -1, 0), frame.up));
    }
    const auto row = [&](const char* what, double value, const char* unit, double must,
                         double aim) {
      add_row({"shapes", std::string(subject.name) + what, value, unit, must, aim});
    };
    row(": mean offset", std::abs(sum / effort.tilts), "voxels", kOffset, kOffsetAim);
    row(": largest offset", most, "voxels", kOffset, kOffsetAim);
    row(": angle", degrees, "deg", kDegrees, kDegreesAim);
  }
  measure_shape_edges(effort, add_row);
  measure_shape_slides(effort, add_row);
}

void measure_shape_edges(const Effort& effort, const RowSink& add_row) {
  for (const EdgedTool& subject : edged_tools()) {
    const std::vector<Point> surface = surface_points(subject.tool);
    const SampledTool tool(subject.tool);
    RandomNumbers random(7);
    double sum = 0, most = 0;
    for (int k = 0; k < effort.tilts; ++k) {
      const Frame frame(random, {21, 21, 21});
      const Axes axes = standing_on(random.direction(), random);
      // The edge of 90 degrees lies where a tool about `frame.place` touches it.
      const auto above = [&](Point along) {
        return dot(along, frame.up) + std::abs(dot(along, frame.across));
      };
      std::vector<Point> near;
      double lowest = 1e9;
      for (const Point& point : surface) {
        near.push_back(axes.to_world(point));
        lowest = std::min(lowest, above(near.back()));
      }
      std::erase_if(near, [&](const Point& point) { return above(point) > lowest + 2.5; });
      const Body body = blurred({44, 44, 44}, [&](Point p) {
        return (above(p - frame.place) - lowest) * std::sqrt(0.5);
      });
      const Point rest = rest_of<N>(tool, body, frame.place, frame.up, axes.orientation<N>(), 20);
      const Point out = unit(rest - frame.at(0, -1, 0));  // from the hand
      const double off = -depth_of(body, near, rest, out);
      sum += off;
      most = std::max(most, std::abs(off));
    }
    const auto row = [&](const char* what, double value) {
      add_row({"shapes", std::string(subject.name) + what, value, "voxels", 0.18, 0.075});
    };
    row(": sharp edge, to the iso-surface: mean offset", std::abs(sum / effort.tilts));
    row(": sharp edge, to the iso-surface: largest offset", most);
  }
}

}  // namespace kerf::extremes
