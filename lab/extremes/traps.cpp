// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

#include "controller/load/scene_place.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/phantom.hpp"
#include "lab/extremes/measures.hpp"
#include "lab/rig/body.hpp"
#include "lab/rig/miller.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {
namespace {

constexpr std::int32_t kEdge = 64;
constexpr double kVoxelMm = 0.125, kMiddle = (kEdge - 1) / 2.0;
constexpr int kPressesPerScene = 24;

/// What is milled, about the device's origin and turned anyhow.
enum class Matter { flat, crown, layers, rubble, pit, count };

Body body_of_matter(Matter matter, Dice& dice) {
  const VoxelGrid grid{kEdge, kEdge, kEdge};
  const auto mm = [](Point p) { return kVoxelMm * (p - Point{kMiddle, kMiddle, kMiddle}); };
  const auto filled = [](double distance_mm) { return 0.5 - distance_mm / (2 * kVoxelMm); };
  switch (matter) {
    case Matter::crown: {
      double top_mm = 12;
      while (phantom_signed_distance(1, 1, top_mm) > 0) top_mm -= 0.01;
      return body_of(grid, [&](Point p) {
        const Point at = mm(p);
        return filled(phantom_signed_distance(at[0] + 1, 1 - at[2], at[1] + top_mm));
      });
    }
    case Matter::layers: {  // hard, less hard, and a chamber that is softer than the iso
      const double soft = dice.uniform(0, 0.4);
      return body_of(grid, [&](Point p) {
        const Point at = mm(p);
        const double hard = std::clamp(filled(at[1]), 0.0, 1.0);
        const double core = std::clamp(filled(length(at - Point{0, -2.5, 0}) - 1.5), 0.0, 1.0);
        const double mid = std::clamp(filled(at[1] + 0.8), 0.0, 1.0);
        return hard * (1 - 0.35 * mid) * (1 - core) + soft * core;
      });
    }
    case Matter::rubble: {
      std::array<std::pair<Point, double>, 24> bits;
      for (auto& [place, radius] : bits) {
        place = {dice.uniform(-3, 3), dice.uniform(-3.5, -0.5), dice.uniform(-3, 3)};
        radius = dice.uniform(0.3, 1.2);
      }
      return body_of(grid, [&](Point p) {
        double nearest_mm = 9;
        for (const auto& [place, radius] : bits) {
          nearest_mm = std::min(nearest_mm, length(mm(p) - place) - radius);
        }
        return filled(nearest_mm);
      });
    }
    case Matter::pit: {  // a groove and a hole, as others have milled them
      const double radius_mm = dice.uniform(0.3, 1.2);
      return body_of(grid, [&](Point p) {
        const Point at = mm(p);
        const double hole = std::hypot(at[0] - 0.5, at[2]) - radius_mm;
        const double groove = std::hypot(at[0] + 0.7, at[1]) - radius_mm;
        return filled(std::max({at[1], -hole, -groove}));
      });
    }
    default:
      return body_of(grid, [&](Point p) { return filled(mm(p)[1]); });
  }
}

/// A scene of all shapes that cut by force; `softness` scales the matter, its iso stays.
LoadedScene trap_scene(Matter matter, double softness, Dice& dice) {
  LoadedScene scene;
  Body body = body_of_matter(matter, dice);
  for (Density& density : body.density) {
    density = static_cast<Density>(std::lround(softness * density));
  }
  SceneVolume& volume = scene.volumes.emplace_back();
  volume.name = "matter";
  volume.image.grid = body.grid;
  volume.image.spacing_mm = {kVoxelMm, kVoxelMm, kVoxelMm};
  volume.image.density = std::move(body.density);
  volume.iso = static_cast<Density>(std::lround(0.45 * kDensityMax));
  const Point axis = std::sin(dice.uniform(0, 0.5)) * dice.direction();
  const double w = std::sqrt(std::max(0.0, 1 - dot(axis, axis)));
  volume.pose =
      place_volume(volume.image, rotation_of(std::array{axis[0], axis[1], axis[2], w}), {0, 0, 0});
  for (const std::string_view shape : kToolShapes) {
    const std::string name(shape);
    const double radius_mm = dice.uniform(0.4, 1);
    scene.tools.push_back(make_tool(name, name, {.pitch_mm = kVoxelMm, .radius_mm = radius_mm}));
  }
  scene.force.model = ForceModel::proxy;
  scene.cut.model = CutModel::preston;
  constexpr double kRates[] = {1, 4, 8};
  scene.cut.machinability_mm3_per_s_n *= kRates[static_cast<std::size_t>(dice.uniform(0, 3))];
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  return scene;
}

/// What a press met.
struct Pressed {
  double longest_s = 0;  ///< of force above the threshold and no removal
  double held_n = 0;     ///< at the end
};

/// Five seconds of a hand that presses with `force_n` along `direction` and trembles by 0.1 mm; it
/// goes on at 50 mm/s where nothing holds it, and ends the press where it leaves the matter.
Pressed press(Miller& miller, Point from, Point direction, double force_n, const LoadedScene& scene,
              double seconds) {
  constexpr double kStepMm = 0.05, kTremorMm = 0.1, kTremorHz = 9, kLeftMm = 5;
  const double lead_mm = force_n / scene.force.stiffness_n_per_mm;
  const Point across = unit(cross(direction, Point{0.3, 0.1, 1}));
  Point hand = from, proxy = from;
  Pressed seen;
  int still = 0;
  const int ticks = static_cast<int>(seconds * scene.servo.rate_hz);
  for (int tick = 0; tick < ticks; ++tick) {
    const double t = static_cast<double>(tick) / scene.servo.rate_hz;
    const Point goal = proxy + lead_mm * direction +
                       kTremorMm * std::sin(2 * std::numbers::pi * kTremorHz * t) * across;
    const Point way = goal - hand;
    hand = hand + std::min(1.0, kStepMm / std::max(kStepMm, length(way))) * way;
    const ServoOutput out = miller.step(hand);
    for (std::size_t i = 0; i < 3; ++i) proxy[i] = out.position_mm[i] + out.proxy_offset_mm[i];
    const double felt_n = length(out.force_n);
    still = felt_n > 1.2 * scene.cut.threshold_n && out.removed_steps == 0 ? still + 1 : 0;
    seen.longest_s = std::max(seen.longest_s, static_cast<double>(still) / scene.servo.rate_hz);
    seen.held_n = felt_n;
    if (length(proxy) > kLeftMm) break;
  }
  return seen;
}

}  // namespace

void measure_traps(const Effort& effort, const RowSink& add_row) {
  constexpr double kPressS = 5, kTrappedS = 0.5, kSoftest = 0.2, kHardest = 0.97;
  const auto runs = [&](const char* what, int presses, bool soft) {
    Dice dice(soft ? 29 : 16);
    int trapped = 0;
    double longest_s = 0, held_n = 0;
    for (int done = 0; done < presses; done += kPressesPerScene) {
      const auto matter = static_cast<Matter>(dice.uniform(0, static_cast<int>(Matter::count)));
      // Softer than the iso by this much, all of it.
      const double softness = soft ? 0.45 * dice.uniform(kSoftest, kHardest) : 1;
      const LoadedScene scene = trap_scene(soft ? Matter::flat : matter, softness, dice);
      Miller miller(scene, {0, 2.5, 0});
      for (int i = 0; i < kPressesPerScene; ++i) {
        const auto tool = static_cast<std::uint32_t>(i) % scene.tools.size();
        const Point from{dice.uniform(-1.5, 1.5), 2.5, dice.uniform(-1.5, 1.5)};
        miller.servo().apply({ServoCommand::Kind::select_tool, static_cast<std::uint32_t>(tool)});
        static_cast<void>(miller.hold({0, 4, 0}, 0.2));
        static_cast<void>(miller.hold(from, 0.2));
        const Point down = unit(Point{dice.uniform(-0.7, 0.7), -1, dice.uniform(-0.7, 0.7)});
        const double force_n = dice.uniform(0.1, 1);
        const Pressed seen = press(miller, from, down, force_n, scene, soft ? 1 : kPressS);
        trapped += seen.longest_s > kTrappedS ? 1 : 0;
        longest_s = std::max(longest_s, seen.longest_s);
        held_n = std::max(held_n, seen.held_n);
      }
    }
    if (soft) {
      add_row({"traps", what, held_n, "N", 0.01, 0});
      return;
    }
    add_row({"traps", what, static_cast<double>(trapped), "", 0, 0});
    add_row({"traps", "longest time of force without removal", longest_s, "s", kTrappedS, 0.2});
  };
  runs("presses that stop cutting for over 0.5 s", effort.presses, false);
  runs("force by matter of 0.2 to 0.97 of the iso", effort.presses / 4, true);
}

}  // namespace kerf::extremes
