// SPDX-License-Identifier: Apache-2.0
// What was removed of which material, sections through the tip, and tools from the side.
#include <algorithm>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>

#include "visualizer/scene/cross_sections.hpp"
#include "visualizer/scene/scene_view.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf::score_test {
namespace {

constexpr VoxelGrid kGrid{20, 10, 9};
constexpr double kVoxelMm3 = 0.5 * 0.5 * 2.0;

/// One volume of voxels of 0.5 x 0.5 x 2 mm, its first voxel in the origin.
SceneView scene_of(std::vector<MaterialView> materials) {
  SceneView scene;
  scene.materials = std::move(materials);
  VolumeView& volume = scene.volumes.emplace_back();
  volume.bricks = BrickGrid::of(kGrid);
  volume.iso = 26'214;  // dentin's 0.4
  volume.world_from_voxel[0][0] = volume.world_from_voxel[1][1] = 0.5;
  volume.world_from_voxel[2][2] = 2.0;
  return scene;
}

const std::vector<MaterialView> kTooth{
    {"none", 0.0}, {"enamel", 0.8, {1, 1, 1}}, {"dentin", 0.4, {0, 1, 0}}};

ChangedBricks all_bricks(const SceneView& scene) {
  ChangedBricks all;
  for (std::uint32_t id = 0; id < scene.volumes[0].bricks.count(); ++id) all.add(ChangedBrick{id});
  return all;
}

}  // namespace

TEST_CASE("the score counts by label, or else by the density that a voxel had at first") {
  const SceneView scene = scene_of(kTooth);
  for (const bool labelled : {false, true}) {
    CAPTURE(labelled);
    std::vector<Density> density(kGrid.voxel_count(), 0);
    std::vector<Label> labels(labelled ? kGrid.voxel_count() : 0, 2);
    const std::size_t hard = kGrid.index(3, 4, 5), soft = kGrid.index(19, 9, 8);
    density[hard] = 60'000;
    density[soft] = 30'000;
    if (labelled) labels[hard] = 1;
    RemovedVolume removed_volume(scene, std::vector<VolumeContent>{{density, labels}});
    CHECK(removed_volume.removed_mm3() == std::vector<double>{0, 0, 0});
    density[hard] = 20'000;  // as dense as dentin, and enamel still
    density[soft] = 0;
    removed_volume.update(0, density, all_bricks(scene));
    const auto removed = removed_volume.removed_mm3();
    CHECK(removed[0] == 0);
    CHECK(removed[1] == doctest::Approx(2.0 / 3 * kVoxelMm3).epsilon(1e-4));
    CHECK(removed[2] == doctest::Approx(kVoxelMm3));
    density[hard] = 60'000;
    density[soft] = 30'000;
    removed_volume.update(0, density, all_bricks(scene));
    CHECK(removed_volume.removed_mm3() == std::vector<double>{0, 0, 0});
  }
}

TEST_CASE("a score that joined late counts nothing for what a reset gives back") {
  const SceneView scene = scene_of(kTooth);
  std::vector<Density> density(kGrid.voxel_count(), 0);
  const std::vector<Label> labels(kGrid.voxel_count(), 1);
  const std::size_t cut_before = kGrid.index(3, 4, 5), cut_now = kGrid.index(19, 9, 8);
  density[cut_now] = 60'000;
  RemovedVolume removed_volume(scene, std::vector<VolumeContent>{{density, labels}});
  density[cut_before] = 60'000;
  removed_volume.update(0, density, all_bricks(scene));
  CHECK(removed_volume.removed_mm3() == std::vector<double>{0, 0, 0});
  for (const std::size_t at : {cut_before, cut_now}) {
    density[at] = 0;
    removed_volume.update(0, density, all_bricks(scene));
  }
  CHECK(removed_volume.removed_mm3()[1] == doctest::Approx(2 * kVoxelMm3));
}

TEST_CASE("three sections show what lies in their planes through the tip, and where that is") {
  const SceneView scene = scene_of(kTooth);
  std::vector<Density> density(kGrid.voxel_count(), 0);
  const VoxelIndex at{15, 2, 6};  // right, low, near
  density[kGrid.index(at.x, at.y, at.z)] = 65'535;
  const std::vector<VolumeContent> contents{{density, {}}};
  const glm::dvec3 tip{0.5 * at.x, 0.5 * at.y, 2.0 * at.z};
  constexpr int kSide = 90;
  const SliceViews seen = slice_views(scene, contents, tip, kSide);
  const auto bright = [](const SliceViews& views, std::size_t s) {
    const auto size = static_cast<std::ptrdiff_t>(kSide) * kSide * 3;
    const auto from = views.rgb.begin() + static_cast<std::ptrdiff_t>(s) * size;
    return std::count_if(from, from + size, [](std::uint8_t value) { return value > 200; });
  };
  for (std::size_t s = 0; s < 3; ++s) {
    CAPTURE(kSliceNames[s]);
    CHECK(bright(seen, s) > 0);
    const auto column = static_cast<std::size_t>(seen.tip[s][0] * kSide);
    const auto row = static_cast<std::size_t>(seen.tip[s][1] * kSide);
    CHECK(seen.rgb[3 * ((s * kSide + row) * kSide + column) + 1] > 200);
  }
  CHECK(seen.tip[0][0] > 0.5);  // from above: to the right, and towards the user
  CHECK(seen.tip[0][1] > 0.5);
  CHECK(seen.tip[1][1] > 0.5);  // from in front: low
  CHECK(seen.tip[2][0] < 0.5);  // from its right side the user is to the left
  const SliceViews beside = slice_views(scene, contents, tip + glm::dvec3(0, 0, 4), kSide);
  CHECK(bright(beside, 1) == 0);
  CHECK(bright(beside, 2) > 0);
}

TEST_CASE("a tool from the side has the rows of its profile, then as much of its shaft") {
  ToolView bur{.name = "pear", .profile_mm = {{-1, 0}, {0, 1}, {2, 0.5}}, .radius_mm = 1};
  CHECK(silhouette_of(bur) == Silhouette{{-1, 0, 0}, {0, -1, 1}, {2, -0.5, 0.5}});
  bur.shaft_mm = {{1, 0}, {1, 0.8}, {20, 0.8}};
  const Silhouette with_shaft = silhouette_of(bur);
  CHECK(with_shaft.back() == std::array<double, 3>{5, -0.8, 0.8});
  CHECK(std::is_sorted(with_shaft.begin(), with_shaft.end(),
                       [](const auto& a, const auto& b) { return a[0] < b[0]; }));
  CHECK(silhouette_of({}).empty());
}

TEST_CASE("a tool that is a mesh has its widest points at each height") {
  ToolView wedge;
  wedge.facets.points_mm = {{-1, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 1}};
  wedge.facets.triangles = {{0, 1, 2}, {1, 3, 2}, {3, 0, 2}, {0, 3, 1}};
  const Silhouette rows = silhouette_of(wedge);
  REQUIRE(rows.size() > 10);
  for (const auto& [y, left, right] : rows) {
    CHECK(left == doctest::Approx(-(1 - y / 2)));
    CHECK(right == doctest::Approx(1 - y / 2));
  }
}

TEST_CASE("the colours of Okabe and Ito are given to all materials but none") {
  std::vector<MaterialView> materials = kTooth;
  take_okabe_ito(materials);
  CHECK(materials[0].colour == kTooth[0].colour);
  CHECK(materials[1].colour.b > materials[1].colour.r);  // sky blue
  CHECK(materials[2].colour.r > materials[2].colour.b);  // yellow
}

}  // namespace kerf::score_test
