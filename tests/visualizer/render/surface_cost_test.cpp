// SPDX-License-Identifier: Apache-2.0
// What the mesh of the paper's tooth costs. Figures, so not part of the tests:
//   KERF_DATA=../shared/data test_visualizer --no-skip -tc='*cost*'
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "shared/numeric/statistics.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/surface/volume_surface.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr VoxelGrid kFile{103, 94, 161};
constexpr double kAir = 391.0;
constexpr double kFull = 1300.0;

Density density_of(double value) {
  return static_cast<Density>(std::min(value, kFull) / kFull * kDensityMax);
}

/// The 16-bit tooth in the middle of 256x256x161 voxels of air, as the paper had it; empty where
/// the file is not there.
std::vector<Density> padded_tooth(VoxelGrid grid) {
  const char* folder = std::getenv("KERF_DATA");
  std::ifstream file(
      std::filesystem::path(folder != nullptr ? folder : "") / "ge_tooth_16bit" / "tooth.raw",
      std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.size() != 2 * kFile.voxel_count()) return {};
  std::vector<Density> density(grid.voxel_count(), density_of(kAir));
  std::size_t at = 0;
  for (int z = 0; z < kFile.nz; ++z) {
    for (int y = 0; y < kFile.ny; ++y) {
      for (int x = 0; x < kFile.nx; ++x, at += 2) {
        const auto high = static_cast<unsigned char>(bytes[at]);
        const auto low = static_cast<unsigned char>(bytes[at + 1]);
        density[grid.index(x + 76, y + 81, z)] = density_of(high * 256.0 + low);
      }
    }
  }
  return density;
}

}  // namespace

TEST_CASE("cost of a mesh: the whole tooth, and again after cuts of 16^3" * doctest::skip()) {
  const VoxelGrid grid{256, 256, 161};
  const std::vector<Density> whole = padded_tooth(grid);
  if (whole.empty()) {
    MESSAGE("skipped: KERF_DATA names no folder with ge_tooth_16bit/tooth.raw");
    return;
  }
  VolumeView view;
  view.bricks = BrickGrid::of(grid);
  view.iso = density_of(620.0);
  std::vector<double> full_ms;
  for (int i = 0; i < 5; ++i) {
    const Stopwatch watch;
    const VolumeSurface surface(view, {}, whole, {});
    full_ms.push_back(watch.cpu_ms());
  }

  // Balls about points of the surface, cut and then put back.
  std::vector<Density> density = whole;
  VolumeSurface surface(view, {}, density, {});
  std::mt19937 random(5);
  std::vector<double> cut_ms;
  for (int cut = 0; cut < 200; ++cut) {
    VoxelIndex at{96 + static_cast<int>(random() % 60), 101 + static_cast<int>(random() % 50), 160};
    while (at.z > 8 && density[grid.index(at.x, at.y, at.z)] < view.iso) --at.z;
    const VoxelBox box = VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}}.grown(8).clipped(grid.box());
    const ChangedBricks changed = changed_in(view.bricks, box);
    for (const bool back : {false, true}) {
      for (int z = box.lo.z; z < box.hi.z; ++z) {
        for (int y = box.lo.y; y < box.hi.y; ++y) {
          for (int x = box.lo.x; x < box.hi.x; ++x) {
            const glm::ivec3 from(x - at.x, y - at.y, z - at.z);
            if (from.x * from.x + from.y * from.y + from.z * from.z > 64) continue;
            const std::size_t voxel = grid.index(x, y, z);
            density[voxel] = back ? whole[voxel] : static_cast<Density>(whole[voxel] / 4);
          }
        }
      }
      const Stopwatch watch;
      surface.update(density, changed);
      cut_ms.push_back(watch.cpu_ms());
    }
  }
  MESSAGE("256x256x161, first extraction: " << percentile(full_ms, 0.5) << " cpu ms");
  MESSAGE("after a cut of 16^3: p50 " << percentile(cut_ms, 0.5) << ", p99 "
                                      << percentile(cut_ms, 0.99) << " cpu ms");
  CHECK(percentile(full_ms, 0.5) < 60.0);
  CHECK(percentile(cut_ms, 0.5) < 1.0);
}
