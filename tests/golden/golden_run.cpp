// SPDX-License-Identifier: Apache-2.0
#include "tests/golden/golden_run.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "controller/plan/compile.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/golden/golden_hash.hpp"
#include "tests/golden/golden_script.hpp"

namespace kerf::test {
namespace {

/// A ball with a soft rim in a thin noise.
SceneVolume blob(VoxelGrid grid, std::array<double, 3> spacing_mm, Pose pose) {
  SceneVolume volume;
  volume.image.grid = grid;
  volume.image.spacing_mm = spacing_mm;
  volume.pose = pose;
  volume.image.density.reserve(grid.voxel_count());
  std::uint32_t noise = 1;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        noise = noise * 1'664'525U + 1'013'904'223U;
        const std::int32_t i = 2 * x - grid.nx, j = 2 * y - grid.ny, k = 2 * z - grid.nz;
        const std::int32_t depth = 900 - (i * i + j * j + k * k);
        const std::uint32_t density = depth > 220 ? 60'000 + (noise >> 20)
                                      : depth > 0 ? static_cast<std::uint32_t>(depth) * 270
                                                  : noise >> 25;
        volume.image.density.push_back(static_cast<Density>(density));
      }
    }
  }
  return volume;
}

/// Shells of three materials around the middle.
void label(VolumeImage& image) {
  const VoxelGrid& grid = image.grid;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        const std::int32_t i = 2 * x - grid.nx, j = 2 * y - grid.ny, k = 2 * z - grid.nz;
        const std::int32_t square = i * i + j * j + k * k;
        image.labels.push_back(square > 700 ? 1 : (square > 550 ? 2 : 3));
      }
    }
  }
}

/// Those samples of a grid of `side` per axis that `is_part` of the tool; half pitches.
template <class Predicate>
SceneTool tool_of(std::int32_t side, double pitch_mm, bool round, Predicate is_part) {
  SceneTool tool;
  tool.pitch_mm = pitch_mm;
  tool.round = round;
  tool.size_vox = {side, side, side};
  for (std::int32_t z = 1 - side; z < side; z += 2) {
    for (std::int32_t y = 1 - side; y < side; y += 2) {
      for (std::int32_t x = 1 - side; x < side; x += 2) {
        if (!is_part(x, y, z)) continue;
        tool.offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                static_cast<std::int16_t>(z)});
      }
    }
  }
  return tool;
}

SceneTool ball(std::int32_t side, double pitch_mm) {
  return tool_of(side, pitch_mm, true, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    return x * x + y * y + z * z <= side * side;
  });
}

/// Without any symmetry, so that a turn the wrong way shows.
SceneTool hook(std::int32_t side, double pitch_mm) {
  return tool_of(side, pitch_mm, false, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    return (x < 0 && z < 2) || (y < 0 && x > 1) || (z > 1 && y > 1 && x < 2);
  });
}

}  // namespace

LoadedScene golden_scene(GoldenScene which, NumericKind numeric) {
  constexpr double kVoxelMm = 0.125;
  LoadedScene scene;
  scene.path = "golden";
  // The lattice of the tools of its own pitch, then one that no tool fits: turned, not cubic.
  scene.volumes.push_back(
      blob({44, 42, 40}, {kVoxelMm, kVoxelMm, kVoxelMm}, {{-2.75, -2.625, -2.5}, {0, 0, 0, 1}}));
  scene.volumes.push_back(
      blob({30, 34, 26}, {0.15, 0.11, 0.17}, {{0.5, -2.0, -1.0}, {0.48, 0, 0.36, 0.8}}));
  if (which == GoldenScene::mill) {
    scene.tools = {ball(6, kVoxelMm), hook(4, kVoxelMm), ball(7, kVoxelMm), hook(5, 0.11),
                   ball(6, 0.1)};
  } else if (which == GoldenScene::feel) {
    scene.tools = {hook(5, kVoxelMm), hook(7, 0.09)};
  } else {
    scene.tools = {
        make_tool("ball", "ball", {.pitch_mm = kVoxelMm, .size_vox = 6}),
        make_tool("shaft", "cylinder", {.pitch_mm = kVoxelMm, .radius_mm = 0.3, .length_mm = 1.5})};
    scene.force.friction = 0.2;
    label(scene.volumes[0].image);
    scene.materials.resize(4);
    scene.materials[2].machinability = 3;
    scene.materials[3].forbidden = true;
    scene.cut.machinability_mm3_per_s_n = 4;
  }
  scene.device.workspace_scale = 0.75;
  scene.device.offset_mm = {4.1875, 47.25, 60.375};  // the middle of the hand's way
  scene.device.torque_scale = std::array{0.342, 0.342, -0.342};
  scene.force.p0_n_per_mm2 = 12.0;  // of the paper's force
  if (which != GoldenScene::sweep) scene.force.model = ForceModel::paper;
  scene.cut.model = which == GoldenScene::mill   ? CutModel::overlap_exact
                    : which == GoldenScene::feel ? CutModel::none
                                                 : CutModel::preston;
  scene.cut.rate_per_s = 6.0;
  scene.cut.p1_n_per_mm2 = 8.0;
  scene.limits.speed_mm_per_s = 2'000;
  scene.servo.numeric = numeric;
  return scene;
}

GoldenRun golden_run(GoldenScene which, NumericKind numeric, const KernelSet& kernels) {
  const std::int32_t ticks = golden_ticks(which);
  LoadedScene scene = golden_scene(which, numeric);
  const auto tools = static_cast<std::uint32_t>(scene.tools.size());
  const std::size_t volumes = scene.volumes.size();
  const std::unique_ptr<CompiledScene> servo = compile(scene, kernels);

  GoldenRun run;
  for (const TickCost& pair : servo->costs().ticks) run.methods.insert(pair.choice.method->step);
  GoldenHash hash(which);
  std::uint64_t volume_hash = kFnv1aBasis;
  ServoOutput last;
  for (std::int32_t tick = 0; tick < ticks; ++tick) {
    servo->apply(scripted_command(tick, tools));
    const ServoOutput out = servo->step(scripted_report(tick));
    hash.add(out);
    if (tick % kPenetrationTicks == 0) hash.add(servo->penetration_mm());
    run.forbidden_ticks += out.forbidden ? 1 : 0;
    run.contact_ticks += out.contact ? 1 : 0;
    run.late_contact_ticks += out.contact && tick >= ticks * 3 / 4 ? 1 : 0;
    run.stale_ticks += out.stale ? 1 : 0;
    run.limited_ticks += out.clamped ? 1 : 0;
    run.motor_ticks += out.motors_on ? 1 : 0;
    const bool is_new = out.fault != last.fault;
    run.stale_faults += is_new && out.fault == Fault::stale_input ? 1 : 0;
    run.speed_faults += is_new && out.fault == Fault::overspeed ? 1 : 0;
    run.outings += last.phase == Phase::armed && out.phase == Phase::ramping ? 1 : 0;
    for (std::size_t v = 0; v < volumes; ++v) run.removed_steps[v] += out.removed_by_volume[v];
    last = out;
  }
  for (std::size_t v = 0; v < volumes; ++v) {
    volume_hash = fnv1a_bytes(volume_hash, density_hash(servo->density(v)));
  }
  run.hash = hex64(hash.value());
  run.volume_hash = hex64(volume_hash);
  return run;
}

}  // namespace kerf::test
