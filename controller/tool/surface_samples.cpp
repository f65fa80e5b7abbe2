// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/surface_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <sstream>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf {
namespace {

static_assert(kMaxSurfaceSamples * 1.02 < kMaxShellPoints);  // rings are rounded to whole samples

constexpr int kProfileSteps = 2048;  // no corner but the shape's own turns by more than 0.1 deg
constexpr double kRimAngle = 0.2;    // rad
constexpr double kBeforeRim = 0.05;  // of the distance of rings; tuned, see the header
constexpr double kGoldenAngle = 2.399963229728653;  // pi (3 - sqrt(5))

using Point = vec3::Vec;
using Profile = std::vector<std::array<double, 2>>;  // {y, radius}

double length_of(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return hypotenuse(b[0] - a[0], b[1] - a[1]);
}

double area_of(const Profile& profile) {
  double area = 0;
  for (std::size_t k = 1; k < profile.size(); ++k) {
    area += std::numbers::pi * (profile[k - 1][1] + profile[k][1]) *
            length_of(profile[k - 1], profile[k]);
  }
  return area;
}

std::vector<Point> fibonacci_ball(double radius_mm, int count) {
  // Layers of equal area begin at 0.5; a little nearer to the poles these are no emptier than the
  // rest (the worst normal on a ball of 6 is 0.5 degrees off instead of 0.7).
  constexpr double kFirst = 0.36;
  std::vector<Point> samples;
  for (int i = 0; i < count; ++i) {
    const double y = 2 * (i + kFirst) / (count - 1 + 2 * kFirst) - 1, across = std::sqrt(1 - y * y);
    const auto [x, z] = on_circle(i * kGoldenAngle);
    samples.push_back({radius_mm * across * x, radius_mm * y, radius_mm * across * z});
  }
  return samples;
}

/// The smooth parts of a profile, from rim to rim.
std::vector<std::span<const std::array<double, 2>>> smooth_parts(const Profile& profile) {
  std::vector<std::span<const std::array<double, 2>>> parts;
  const auto heading = [&](std::size_t k) {
    return arctangent(profile[k + 1][1] - profile[k][1], profile[k + 1][0] - profile[k][0]);
  };
  std::size_t first = 0;
  double before = heading(0);
  for (std::size_t k = 1; k + 1 < profile.size(); ++k) {
    const double here = heading(k);
    if (std::abs(here - std::exchange(before, here)) < kRimAngle) continue;
    parts.emplace_back(profile.data() + first, k - first + 1);
    first = k;
  }
  parts.emplace_back(profile.data() + first, profile.size() - first);
  return parts;
}

class RingSampler {
 public:
  explicit RingSampler(double pitch_mm) : pitch_mm_(pitch_mm) {}

  /// From the axis or a rim to the next. On an axis the rings begin half a distance from it.
  void add(std::span<const std::array<double, 2>> part) {
    double length_mm = 0;
    for (std::size_t k = 1; k < part.size(); ++k) length_mm += length_of(part[k - 1], part[k]);
    const double point_mm = add_point(part), rest_mm = length_mm - point_mm;
    const double begin = part.front()[1] == 0 ? 0.5 : 1 - kBeforeRim;
    const double end = part.back()[1] == 0 ? 0.5 : kBeforeRim;
    const int rings =
        std::max(1, static_cast<int>(std::lround(rest_mm / pitch_mm_ + 1 - begin - end)));
    const double distance_mm = rest_mm / (rings - 1 + begin + end);
    for (int ring = 0; ring < rings; ++ring) {
      const bool on_rim = ring == rings - 1 && end == kBeforeRim;
      add_ring(part, point_mm + (ring + begin) * distance_mm, distance_mm, on_rim);
    }
  }

  [[nodiscard]] std::vector<SurfaceSample> samples() && { return std::move(samples_); }

 private:
  /// The tip of a part that begins with a point, and how much of the part is its share.
  double add_point(std::span<const std::array<double, 2>> part) {
    const double slope = (part[1][1] - part[0][1]) / length_of(part[0], part[1]);
    if (part[0][1] != 0 || slope > 0.95) return 0;
    samples_.push_back({{0, part[0][0], 0}, {}});
    return pitch_mm_ / std::sqrt(std::numbers::pi * slope);  // a cone of the area pitch^2
  }

  void add_ring(std::span<const std::array<double, 2>> part, double arc_mm, double distance_mm,
                bool on_rim) {
    std::size_t k = 1;
    for (; k + 1 < part.size() && arc_mm > length_of(part[k - 1], part[k]); ++k) {
      arc_mm -= length_of(part[k - 1], part[k]);
    }
    const double share = arc_mm / length_of(part[k - 1], part[k]);
    const double y_mm = std::lerp(part[k - 1][0], part[k][0], share);
    const double radius_mm = std::lerp(part[k - 1][1], part[k][1], share);
    const double smooth = on_rim ? 0 : 1 / length_of(part[k - 1], part[k]);
    const double outward = smooth * (part[k][0] - part[k - 1][0]);
    const double upward = smooth * (part[k - 1][1] - part[k][1]);
    const double area_mm2 = 2 * std::numbers::pi * radius_mm * distance_mm;
    const int count =
        std::max(1, static_cast<int>(std::lround(area_mm2 / (pitch_mm_ * pitch_mm_))));
    turn_ += kGoldenAngle;
    for (int i = 0; i < count; ++i) {
      const auto [x, z] = on_circle(turn_ + 2 * std::numbers::pi * i / count);
      samples_.push_back(
          {{radius_mm * x, y_mm, radius_mm * z}, {outward * x, upward, outward * z}});
    }
  }

  double pitch_mm_;
  double turn_ = 0;
  std::vector<SurfaceSample> samples_;
};

/// Of any shape but a ball.
std::vector<SurfaceSample> samples_apart(const SceneTool& tool, const Profile& profile,
                                         double pitch_mm, Relaxation relaxation = kEven) {
  if (profile.empty()) {
    const double count = std::ceil(surface_mm2(tool.mesh) / (pitch_mm * pitch_mm));
    return mesh_surface_samples(tool.mesh, static_cast<std::size_t>(count), relaxation);
  }
  RingSampler rings(pitch_mm);
  for (const auto& part : smooth_parts(profile)) rings.add(part);
  return std::move(rings).samples();
}

std::vector<Point> places_of(const std::vector<SurfaceSample>& samples) {
  std::vector<Point> places;
  for (const SurfaceSample& sample : samples) places.push_back(sample.at);
  return places;
}

Profile profile_of(const SceneTool& tool) {
  return tool.mesh.triangles.empty() ? tool_profile(tool, kProfileSteps) : Profile{};
}

void check_count(const SceneTool& tool, double count, double unit_mm) {
  if (count <= kMaxSurfaceSamples) return;
  std::ostringstream line;
  line << "tool '" << tool.name << "': " << std::llround(count)
       << " samples of its surface, of which contact "
       << "reads at most " << kMaxSurfaceSamples
       << " in time; use a smaller tool or coarser voxels than " << unit_mm << " mm";
  throw LoadError(line.str());
}

}  // namespace

std::vector<Point> surface_samples(const SceneTool& tool, double unit_mm) {
  const Profile profile = profile_of(tool);
  const double area_mm2 = profile.empty() ? surface_mm2(tool.mesh) : area_of(profile);
  const double finest_mm = std::sqrt(area_mm2 / kMinSurfaceSamples);
  const double widest =
      tool.round ? ball_sample_pitch(tool.radius_mm / unit_mm) : kShapeSamplePitch;
  const double pitch_mm = std::min(finest_mm, unit_mm * widest);
  const double count = std::ceil(area_mm2 / (pitch_mm * pitch_mm));
  check_count(tool, count, unit_mm);
  if (tool.round) return fibonacci_ball(tool.radius_mm, static_cast<int>(count));
  auto samples = samples_apart(tool, profile, pitch_mm);
  check_count(tool, static_cast<double>(samples.size()), unit_mm);  // long rims of little area
  return places_of(samples);
}

PartSamples part_samples(const SceneTool& tool, const ToolPart& part, double unit_mm) {
  const auto refuse_part = [&](const std::string& fault) {
    throw LoadError("tool '" + tool.name + "': its " + part.name + fault);
  };
  double reach_mm = 0;
  Profile profile = part.profile;
  for (auto& [y_mm, radius_mm] : profile) {
    reach_mm = std::max(reach_mm, hypotenuse(y_mm, radius_mm));
    y_mm -= part.middle_mm;
  }
  if (reach_mm > kMostReach * unit_mm) {
    std::ostringstream line;
    line << " reaches " << reach_mm << " mm from the tool's centre, of which contact takes at most "
         << kMostReach << " voxels in time; make it shorter, or use coarser voxels than " << unit_mm
         << " mm";
    refuse_part(line.str());
  }
  const double area = area_of(profile) / (unit_mm * unit_mm);
  const double pitch =
      std::sqrt(area / std::clamp(area, double{kMinSurfaceSamples}, double{kMostPartSamples}));
  if (pitch > kWidestPartPitch) {
    std::ostringstream line;
    line << " has a surface of " << area << " voxels, of which contact reads at most "
         << kMostPartSamples * kWidestPartPitch * kWidestPartPitch
         << " in time; make it smaller, or use coarser voxels than " << unit_mm << " mm";
    refuse_part(line.str());
  }
  return {places_of(samples_apart(tool, profile, pitch * unit_mm)),
          samples_apart(tool, profile, kClosePitch * unit_mm)};
}

std::vector<SurfaceSample> close_samples(const SceneTool& tool, double unit_mm) {
  if (tool.round) return {};
  return samples_apart(tool, profile_of(tool), kClosePitch * unit_mm, kNearlyEven);
}

double support_deficit_mm(const ToolMesh& mesh, std::span<const SurfaceSample> close) {
  constexpr int kDirections = 1500;
  double deficit = 0;
  if (mesh.triangles.empty()) return deficit;
  for (const Point& u : fibonacci_ball(1, kDirections)) {
    const auto along = [&](const Point& p) { return u[0] * p[0] + u[1] * p[1] + u[2] * p[2]; };
    double surface = std::numeric_limits<double>::lowest(), samples = surface;
    for (const Point& corner : mesh.points_mm) surface = std::max(surface, along(corner));
    for (const SurfaceSample& sample : close) samples = std::max(samples, along(sample.at));
    deficit = std::max(deficit, surface - samples);
  }
  return deficit;
}

}  // namespace kerf
