// SPDX-License-Identifier: Apache-2.0
#include "lab/extremes/trap_scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string_view>
#include <utility>

#include "controller/load/scene_place.hpp"
#include "controller/scene/materials.hpp"
#include "controller/tool/tool_shaft.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/volume_crop.hpp"
#include "lab/extremes/measured_tools.hpp"
#include "lab/rig/body.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {
namespace {

constexpr double kVoxelMm = 0.125, kIsoShare = 0.45;

/// Numbers of the loop, its rate, and how many presses take the work of 24 in fixed point at 1 kHz.
struct Loop {
  NumericKind numeric;
  int rate_hz, presses;
  const char* name;
};
constexpr Loop kCommon{NumericKind::fixed, 1000, 24, "fixed, 1 kHz"};
constexpr Loop kSlow{NumericKind::fixed, 250, 24, "fixed, 250 Hz"};
constexpr std::array<Loop, 6> kRare{{{NumericKind::fixed, 8000, 6, "fixed, 8 kHz"},
                                     {NumericKind::float64, 250, 24, "double, 250 Hz"},
                                     {NumericKind::float32, 250, 24, "float, 250 Hz"},
                                     {NumericKind::float64, 1000, 6, "double, 1 kHz"},
                                     {NumericKind::float32, 1000, 6, "float, 1 kHz"},
                                     {NumericKind::float64, 8000, 1, "double, 8 kHz"}}};

const Loop& loop_of(std::uint64_t number) {
  const std::size_t turn = number % 24;
  if (turn % 2 == 0) return kCommon;
  return turn % 4 == 1 ? kSlow : kRare[turn / 4];
}

/// Density by place in mm: 0..1, and of what is labelled as soft the share that this has.
struct Matter {
  const char* name;
  std::function<double(Point)> hard;  ///< share of full density
  std::function<double(Point)> soft;  ///< 0..1: how much of the place is soft; none: nothing
};

double filled(double distance_mm) {
  return std::clamp(0.5 - distance_mm / (2 * kVoxelMm), 0.0, 1.0);
}

Matter crown() {
  double top_mm = 12;
  while (phantom_signed_distance(1, 1, top_mm) > 0) top_mm -= 0.01;
  return {"crown",
          [top_mm](Point at) {
            return filled(phantom_signed_distance(at[0] + 1, 1 - at[2], at[1] + top_mm));
          },
          {}};
}

/// Hard, less hard, and a chamber.
Matter layers() {
  return {"layers", [](Point at) { return filled(at[1]) * (1 - 0.35 * filled(at[1] + 0.8)); },
          [](Point at) {
            return filled(length(at - Point{0, -2.5, 0}) - 1.5);
          }};
}

/// Bits that touch and overlap, each third of them soft.
Matter rubble(Dice& dice) {
  std::array<std::pair<Point, double>, 24> bits;
  for (auto& [place, radius] : bits) {
    place = {dice.uniform(-3, 3), dice.uniform(-3.5, -0.5), dice.uniform(-3, 3)};
    radius = dice.uniform(0.3, 1.2);
  }
  const auto nearest = [bits](Point at, std::size_t from, std::size_t to) {
    double nearest_mm = 9;
    for (std::size_t i = from; i < to; ++i) {
      nearest_mm = std::min(nearest_mm, length(at - bits[i].first) - bits[i].second);
    }
    return filled(nearest_mm);
  };
  return {"rubble", [nearest](Point at) { return nearest(at, 0, 24); },
          [nearest](Point at) { return nearest(at, 16, 24); }};
}

/// A groove and a hole, as others have milled them; what is soft fills them.
Matter pit(Dice& dice) {
  const double radius_mm = dice.uniform(0.3, 1.2);
  const auto hollow = [radius_mm](Point at) {
    return std::min(std::hypot(at[0] - 0.5, at[2]), std::hypot(at[0] + 0.7, at[1])) - radius_mm;
  };
  return {"pit", [hollow](Point at) { return filled(std::max(at[1], -hollow(at))); },
          [hollow](Point at) { return filled(std::max(at[1], hollow(at))); }};
}

/// Nested shells of 1.2 to 3 voxels, with tissue in them.
Matter shells(Dice& dice) {
  const double wall_mm = dice.uniform(1.2, 3) * kVoxelMm, gap_mm = dice.uniform(0.4, 1.2);
  const auto depth = [](Point at) { return 3.5 - length(at + Point{0, 3.5, 0}); };
  return {"shells",
          [=](Point at) {
            const double within = std::fmod(depth(at) + gap_mm, wall_mm + gap_mm) - gap_mm;
            return filled(std::max(-depth(at), std::max(-within, within - wall_mm)));
          },
          [=](Point at) { return filled(0.3 - depth(at)); }};
}

/// Parallel thin walls that stand on a floor.
Matter plates(Dice& dice) {
  const double wall_mm = dice.uniform(1.2, 4) * kVoxelMm, gap_mm = dice.uniform(0.2, 1.5);
  return {"plates",
          [=](Point at) {
            const double along = std::fmod(at[0] + 100 * (wall_mm + gap_mm), wall_mm + gap_mm);
            const double wall = std::max(at[1], std::max(-along, along - wall_mm));
            return filled(std::min(wall, at[1] + 2));
          },
          [](Point at) { return filled(at[1] + 0.4); }};
}

Matter block() {
  return {"block at the border", [](Point) { return 1.0; },
          [](Point at) { return filled(std::hypot(at[0], at[2]) - 0.4); }};
}

Matter matter_of(Dice& dice) {
  switch (static_cast<int>(dice.uniform(0, 8))) {
    case 0:
      return crown();
    case 1:
      return layers();
    case 2:
      return rubble(dice);
    case 3:
      return pit(dice);
    case 4:
      return shells(dice);
    case 5:
      return plates(dice);
    case 6:
      return block();
    default:
      return {"flat", [](Point at) { return filled(at[1]); }, {}};
  }
}

/// Voxels about `middle_mm` by what is there; what is soft and below the iso is labelled as pulp.
VolumeImage image_of(VoxelGrid grid, const Matter& matter, Point middle_mm, double softness) {
  VolumeImage image;
  image.grid = grid;
  image.spacing_mm = {kVoxelMm, kVoxelMm, kVoxelMm};
  const Point first =
      middle_mm - 0.5 * kVoxelMm * Point{grid.nx - 1.0, grid.ny - 1.0, grid.nz - 1.0};
  const bool some = softness > 0 && matter.soft;
  image.density = body_of(grid, [&](Point p) {
                    const Point at = first + kVoxelMm * p;
                    const double soft = some ? matter.soft(at) : 0;
                    const double density = (1 - soft) * matter.hard(at) + soft * softness;
                    if (some) {
                      const bool pulp = soft > 0.5 && density < kIsoShare;
                      image.labels.push_back(pulp ? kLabelPulp : kLabelEnamel);
                    }
                    return density;
                  }).density;
  return image;
}

/// A scene around this image, whose middle is at `middle_mm` before all is turned about the origin.
LoadedScene scene_around(VolumeImage image, Point middle_mm, const Loop& loop, Dice& dice) {
  LoadedScene scene;
  SceneVolume& volume = scene.volumes.emplace_back();
  volume.name = "matter";
  volume.iso = static_cast<Density>(std::lround(kIsoShare * kDensityMax));
  volume.image = enclosed_in_air(std::move(image), volume.iso);
  const Point axis = std::sin(dice.uniform(0, 0.5)) * dice.direction();
  const double w = std::sqrt(std::max(0.0, 1 - dot(axis, axis)));
  const Matrix3 turn = rotation_of(std::array{axis[0], axis[1], axis[2], w});
  Point middle{};
  for (std::size_t i = 0; i < 3; ++i) {
    middle[i] = turn[3 * i] * middle_mm[0] + turn[3 * i + 1] * middle_mm[1] +
                turn[3 * i + 2] * middle_mm[2];
  }
  volume.pose = place_volume(volume.image, turn, middle);
  scene.force.model = ForceModel::proxy;
  scene.cut.model = CutModel::preston;
  constexpr double kRates[] = {1, 4, 8};
  scene.cut.machinability_mm3_per_s_n *= kRates[static_cast<std::size_t>(dice.uniform(0, 3))];
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  scene.servo.numeric = loop.numeric;
  scene.servo.rate_hz = loop.rate_hz;
  scene.materials = default_materials();
  scene.materials[kLabelPulp].forbidden = dice.uniform(0, 1) < 0.5;
  return scene;
}

void add_tools(bool bur, Dice& dice, LoadedScene& scene) {
  for (const std::string_view shape : kToolShapes) {
    const std::string name(shape);
    const double radius_mm = dice.uniform(0.4, 1);
    scene.tools.push_back(make_tool(name, name, {.pitch_mm = kVoxelMm, .radius_mm = radius_mm}));
  }
  if (bur) scene.tools.push_back(shipped_bur(1, kVoxelMm));
  for (SceneTool& tool : scene.tools) {
    const bool shafted = dice.uniform(0, 1) < 0.5;
    ToolShaft shaft;
    shaft.radius_mm = tool.radius_mm * dice.uniform(0.3, 1.2);
    shaft.end_mm = tool.length_mm / 2 + dice.uniform(1, 6);
    if (dice.uniform(0, 1) < 0.5) {
      shaft.handpiece_radius_mm = shaft.radius_mm + dice.uniform(0.5, 2);
      shaft.handpiece_end_mm = shaft.end_mm + 8;
    }
    if (shafted) tool.shaft = shaft;
  }
}

}  // namespace

TrapScene trap_scene(std::uint64_t number) {
  Dice dice(number);
  const Loop& loop = loop_of(number);
  const Matter matter = matter_of(dice);
  const bool border = std::string_view(matter.name).starts_with("block");
  const double softness = dice.uniform(0, 1) < 0.5 ? kIsoShare * dice.uniform(0.2, 0.97) : 0;
  const VoxelGrid grid = border ? VoxelGrid{24, 32, 24} : VoxelGrid{64, 64, 64};
  const Point middle_mm = border ? Point{0, -2, 0} : Point{};
  LoadedScene scene =
      scene_around(image_of(grid, matter, middle_mm, softness), middle_mm, loop, dice);
  add_tools(number % 4 == 2, dice, scene);
  std::string what = matter.name;
  if (softness > 0 && matter.soft) {
    what += scene.materials[kLabelPulp].forbidden ? ", forbidden pulp" : ", pulp";
  }
  return {std::move(scene), what + ", " + loop.name, loop.presses};
}

TrapScene soft_scene(std::uint64_t number) {
  Dice dice(~number);
  const Loop& loop = loop_of(number);
  const double softness = kIsoShare * dice.uniform(0.2, 0.97);
  const Matter matter{"soft", [softness](Point at) { return softness * filled(at[1]); }, {}};
  LoadedScene scene = scene_around(image_of({64, 64, 64}, matter, {}, 0), {}, loop, dice);
  add_tools(number % 4 == 2, dice, scene);
  return {std::move(scene), std::string("soft, ") + loop.name, loop.presses};
}

}  // namespace kerf::extremes
