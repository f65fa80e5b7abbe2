// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "controller/scene/phantom.hpp"
#include "controller/scene/tool_shapes.hpp"
#include "hil/lab/extremes/measures.hpp"
#include "hil/lab/extremes/miller.hpp"
#include "hil/lab/extremes/shell_rig.hpp"

namespace kerf::extremes {
namespace {

constexpr double kSideMm = 8;

/// A ball of radius 1 mm over a solid about the device's origin, by its signed distance in mm.
Scene mill_scene(const std::function<double(Point)>& distance_mm, double voxel_mm = 0.125) {
  Scene scene;
  const auto edge = static_cast<std::int32_t>(std::lround(kSideMm / voxel_mm));
  const double corner = -voxel_mm * (edge - 1) / 2;
  Body body = blurred({edge, edge, edge}, [&](Point p) {
    return distance_mm(voxel_mm * p + Point{corner, corner, corner}) / voxel_mm;
  });
  SceneVolume& volume = scene.volumes.emplace_back();
  volume.name = "solid";
  volume.image.grid = body.grid;
  volume.image.spacing_mm = {voxel_mm, voxel_mm, voxel_mm};
  volume.image.density = std::move(body.density);
  volume.pose.position_mm = {corner, corner, corner};
  const auto size_vox = static_cast<std::int32_t>(std::lround(2 / voxel_mm));
  scene.tools.push_back(make_tool("ball", "ball", {.pitch_mm = voxel_mm, .size_vox = size_vox}));
  scene.force.model = ForceModel::proxy;
  scene.cut.model = CutModel::preston;
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  return scene;
}

double flat(Point p) {
  return p[1];
}

/// |removed / SUM G F T - 1| of three seconds of strokes down to 1.7 mm, at a rate that takes many
/// mm^3.
double balance_error(double voxel_mm) {
  Scene scene = mill_scene(flat, voxel_mm);
  // So much that what is carried over is a millionth of all, and no more than lies under the tool.
  scene.cut.machinability_mm3_per_s_n = 64 * voxel_mm;
  scene.cut.threshold_n = 0.0625;  // a number that fixed point holds
  Miller miller(scene);
  for (int ms = 0; ms < 3000; ++ms) {
    static_cast<void>(miller.step({1.5 * std::sin(0.005 * ms), 0.8 - 0.0008 * ms, 0}));
  }
  return std::abs(miller.removed_mm3() / miller.fed_mm3() - 1);
}

/// What the same hand takes off, mm^3.
double removed_at(int rate_hz) {
  Scene scene = mill_scene(flat);
  scene.servo.rate_hz = rate_hz;
  scene.cut.machinability_mm3_per_s_n = 4;
  Miller miller(scene);
  for (int step = 0; step < 10; ++step) {
    static_cast<void>(miller.hold({0.1 * step, 0.8 - 0.1 * step, 0}, 0.02));
  }
  return miller.removed_mm3();
}

/// Largest step of the force over its mean while the ball sinks into the crown of the phantom at
/// the rate of enamel. A count of the encoders is a step of the hand, which is none of the cut.
double milling_step() {
  double top_mm = 12;
  while (phantom_signed_distance(1, 1, top_mm) > 0) top_mm -= 0.01;
  Scene scene = mill_scene(
      [&](Point p) { return phantom_signed_distance(p[0] + 1, 1 - p[2], p[1] + top_mm); });
  scene.force.damping_ns_per_mm = 0;  // of the hand's own steps
  Miller miller(scene);
  constexpr int kSinkMs = 500, kMs = 2500, kFeltMs = 200;
  double last_n = 0, sum_n = 0, most_n = 0;
  Point last_mm{};
  for (int ms = 0; ms < kMs; ++ms) {
    const ServoOutput out = miller.step({0, 1.3 - 0.005 * std::min(ms, kSinkMs), 0});
    const double force_n = length(out.force_n);
    if (ms > kFeltMs) {
      if (out.position_mm == last_mm) most_n = std::max(most_n, std::abs(force_n - last_n));
      sum_n += force_n / (kMs - kFeltMs - 1);
    }
    last_n = force_n;
    last_mm = out.position_mm;
  }
  return most_n / sum_n;
}

}  // namespace

void measure_cutting(const Effort&, const Told& told) {
  for (const double voxel_mm : {0.0625, 0.125, 0.25}) {
    char name[80];
    std::snprintf(name, sizeof name, "removed against the integral of G F, voxels of %g mm",
                  voxel_mm);
    told({"cutting", name, balance_error(voxel_mm), "1", 1e-6, {}});
  }
  const double usual_mm3 = removed_at(1000);
  for (const int rate_hz : {2000, 4000, 8000}) {
    told({"cutting", "removed by the same hand at " + std::to_string(rate_hz) + " Hz against 1 kHz",
          100 * std::abs(removed_at(rate_hz) / usual_mm3 - 1), "%", 3, 1});
  }
  told({"cutting", "milling into the phantom, force step over the mean", 100 * milling_step(), "%",
        2, 1.5});
}

}  // namespace kerf::extremes
