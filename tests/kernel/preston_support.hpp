// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "controller/kernel/cut_law.hpp"
#include "controller/kernel/preston.hpp"
#include "tests/kernel/support.hpp"

/// A tool that cuts by force, without a contact model: tests say where it is and how hard it
/// presses.
namespace kerf::test {

inline constexpr double kEnamelG = 0.0826;  ///< mm^3/(s N), of the feed figures

/// Voxel edge and servo period that turn a machinability into steps per newton.
struct Scale {
  double voxel_mm = 0.125;
  double tick_s = 0.001;

  [[nodiscard]] double steps_per_n(double machinability) const {
    return machinability * tick_s / (voxel_mm * voxel_mm * voxel_mm) * kDensityMax;
  }
  [[nodiscard]] double mm3(double steps) const {
    return steps / kDensityMax * voxel_mm * voxel_mm * voxel_mm;
  }
};

template <class N>
double steps_of(CutBudget<N> budget) {
  return N::kIsFixed ? std::ldexp(double(budget), -kBudgetBits) : double(budget);
}

/// The tool's y axis, and so the spindle's, along an axis of the volume.
enum class Axis { x, y, z };

template <class N = FixedNumbers>
SpindleFrame<N> frame_at(std::array<double, 3> centre_vox, double rim_vox, Axis axis = Axis::y) {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  Transform<typename N::Ratio, WorldSpace, VoxelSpace> rims;
  for (std::size_t a = 0; a < 3; ++a) rims.row[a][a] = typename N::Ratio(1 / rim_vox);
  Transform<Unit, WorldSpace, ToolSpace> turn;  // a turn of the three axes among each other
  const std::size_t first = (static_cast<std::size_t>(axis) + 2) % 3;
  for (std::size_t b = 0; b < 3; ++b) turn.row[(first + b) % 3][b] = Unit(1);
  return {{Real(centre_vox[0]), Real(centre_vox[1]), Real(centre_vox[2])}, rims, turn};
}

/// What one press of the tool did and told.
template <class N>
struct Pressed : PrestonOutcome<N> {
  SurfaceDrag<N> drag;
  bool forbidden = false;
};

/// One unturned tool of the volume's pitch on one volume.
template <class N = FixedNumbers>
struct PrestonRig {
  PrestonRig(TestVolume start, std::vector<ToolOffset> offsets, double rim, Scale of = {})
      : volume(std::move(start)),
        tool(std::move(offsets)),
        rim_vox(rim),
        scale(of),
        memory(40'000),
        cutter(44) {
    plan.rate.fill(force_rate<N>(scale.steps_per_n(kEnamelG)));
  }

  void cover(std::array<double, 3> centre_vox) {
    overlap<N>(volume.grid, tool, pose_at<N>(centre_vox, pitch_vox),
               step_from<N>(pitch_vox * pitch_vox * pitch_vox), cutter.overlap);
  }
  Pressed<N> press(std::array<double, 3> centre_vox, double force_n, double ratio = 1) {
    cover(centre_vox);
    auto covered = covered_voxels<N>(volume.grid, std::span<const Density>(volume.density),
                                     plan.labels, cutter.overlap,
                                     frame_at<N>(centre_vox, rim_vox, axis), std::span(memory));
    Pressed<N> pressed{{}, covered.drag, touched_forbidden(plan, covered) != 0};
    law.threshold_n = typename N::Real(threshold_n);
    const auto sharp = cut_drive<N>(law, typename N::Real(force_n), typename N::Unit(ratio));
    const auto drive = wear.left_of(sharp, law);
    wear.add(sharp);
    static_cast<PrestonOutcome<N>&>(pressed) =
        cut_by_force(plan, drive, std::span<Density>(volume.density), state, covered);
    return pressed;
  }

  TestVolume volume;
  std::vector<ToolOffset> tool;
  double rim_vox;
  double pitch_vox = 1;
  double threshold_n = 0;
  Axis axis = Axis::y;
  Scale scale;
  PrestonPlan<N> plan;
  CutLaw<N> law;
  BurWear<N> wear;
  PrestonState<N> state;
  std::vector<CoveredVoxel<N>> memory;
  Cutter<N> cutter;
};

/// Flat at both ends, its axis along y: offsets of a cylinder of `radius` voxels.
inline std::vector<ToolOffset> flat_cylinder(int radius, int layers) {
  std::vector<ToolOffset> offsets;
  for (int y = 0; y < layers; ++y) {
    for (int z = -radius; z <= radius; ++z) {
      for (int x = -radius; x <= radius; ++x) {
        if (x * x + z * z > radius * radius) continue;
        offsets.push_back({static_cast<std::int16_t>(2 * x), static_cast<std::int16_t>(2 * y),
                           static_cast<std::int16_t>(2 * z)});
      }
    }
  }
  return offsets;
}

}  // namespace kerf::test
