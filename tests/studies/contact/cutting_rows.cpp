// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "controller/load/loaded_scene.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/crop_resample.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/studies/contact/rows.hpp"

namespace kerf::extremes {
namespace {

constexpr double kSideMm = 8, kVoxelMm = 0.125;

/// A ball of radius 1 mm over a solid about the device's origin, by its signed distance in mm.
LoadedScene mill_scene(const std::function<double(Point)>& distance_mm,
                       double voxel_mm = kVoxelMm) {
  LoadedScene scene;
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
  LoadedScene scene = mill_scene(flat, voxel_mm);
  // So much that the carry is a millionth of all, and no more than lies under the tool.
  scene.cut.machinability_mm3_per_s_n = 64 * voxel_mm;
  scene.cut.threshold_n = 0.0625;  // a number that fixed point holds
  CuttingHand miller(scene);
  for (int ms = 0; ms < 3000; ++ms) {
    static_cast<void>(miller.step({1.5 * std::sin(0.005 * ms), 0.8 - 0.0008 * ms, 0}));
  }
  return std::abs(miller.removed_mm3() / miller.fed_mm3() - 1);
}

/// Removed by a force history at a servo rate and a voxel size, mm^3.
double removed_at(int rate_hz, double voxel_mm) {
  LoadedScene scene = mill_scene(flat, voxel_mm);
  scene.servo.rate_hz = rate_hz;
  scene.force.damping_ns_per_mm = 0;  // the history is the spring's
  scene.cut.machinability_mm3_per_s_n = 10 * kEnamelMm3PerSN;
  return removed_by_press(scene);
}

/// Largest step of the force over its mean while the ball sinks into a crown at the rate of enamel,
/// at nine places: in a real tooth one says little about the next.
double milling_step(LoadedScene scene) {
  scene.force.damping_ns_per_mm = 0;  // of the hand's own steps
  double largest = 0;
  for (const double x_mm : {-0.3, 0.0, 0.2}) {
    for (const double z_mm : {-0.2, 0.0, 0.3}) {
      CuttingHand miller(scene, {x_mm, kSinkFromMm, z_mm});
      largest = std::max(largest, sink(miller, x_mm, z_mm).step_ratio);
    }
  }
  return largest;
}

/// The phantom's crown around the middle of its chewing face.
LoadedScene phantom_crown() {
  double top_mm = 12;
  while (phantom_signed_distance(1, 1, top_mm) > 0) top_mm -= 0.01;
  return mill_scene(
      [&](Point p) { return phantom_signed_distance(p[0] + 1, 1 - p[2], p[1] + top_mm); });
}

/// A CT of a tooth whose files name no size, in voxels of 0.125 mm, the device's origin where a
/// hand from above first meets it.
LoadedScene tooth_crown(const std::filesystem::path& file, const Matrix3& standing) {
  LoadedScene scene = mill_scene(flat);
  SceneVolume& volume = scene.volumes.front();
  const SourceVolume source =
      read_volume(file, {.override_spacing_mm = std::array{kVoxelMm, kVoxelMm, kVoxelMm}});
  volume.image = apply_window(source, range_window(source));
  volume.iso = otsu_threshold(volume.image);
  volume.image = crop_to_solid(volume.image, volume.iso);
  volume.pose = place_volume(volume.image, standing, {});
  scene.device.offset_mm = first_surface_from_above(volume);
  return scene;
}

void measure_teeth(const Effort& effort, const RowSink& add_row) {
  struct Tooth {
    const char* name;
    const char* file;
    Matrix3 standing;
  };
  constexpr Matrix3 kUpsideDown = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  for (const Tooth& tooth :
       {Tooth{"GE tooth, 16 bits", "ge_tooth_16bit/tooth.nhdr", kSourceStanding},
        Tooth{"GE tooth, 8 bits", "ge_tooth_8bit/tooth.mhd", kUpsideDown}}) {
    Row row{"cutting", std::string("milling into the ") + tooth.name + ", force step over the mean",
            0,         "%",
            2,         1.5};
    const std::filesystem::path file = effort.data / tooth.file;
    if (effort.data.empty()) {
      row.skipped = "no --data";
    } else if (!std::filesystem::exists(file)) {
      row.skipped = std::string("no ") + tooth.file + " in --data";
    } else {
      row.value = 100 * milling_step(tooth_crown(file, tooth.standing));
    }
    add_row(std::move(row));
  }
}

}  // namespace

void measure_cutting(const Effort& effort, const RowSink& add_row) {
  for (const double voxel_mm : {0.0625, 0.125, 0.25}) {
    char name[80];
    std::snprintf(name, sizeof name, "removed against the integral of G F, voxels of %g mm",
                  voxel_mm);
    add_row({"cutting", name, balance_error(voxel_mm), "1", 1e-6, {}});
  }
  const double usual_mm3 = removed_at(1000, kVoxelMm);
  const auto against_usual = [&](const std::string& by, int rate_hz, double voxel_mm) {
    add_row({"cutting", "removed by the same force " + by,
             100 * std::abs(removed_at(rate_hz, voxel_mm) / usual_mm3 - 1), "%", 3, 1});
  };
  for (const int rate_hz : {250, 500, 2000, 4000, 8000}) {
    against_usual("at " + std::to_string(rate_hz) + " Hz, against 1 kHz", rate_hz, kVoxelMm);
  }
  for (const double voxel_mm : {0.05, 0.1, 0.25}) {
    char by[64];
    std::snprintf(by, sizeof by, "in voxels of %g mm, against 0.125", voxel_mm);
    against_usual(by, 1000, voxel_mm);
  }
  add_row({"cutting", "milling into the phantom, force step over the mean",
           100 * milling_step(phantom_crown()), "%", 2, 1.5});
  measure_teeth(effort, add_row);
}

}  // namespace kerf::extremes
