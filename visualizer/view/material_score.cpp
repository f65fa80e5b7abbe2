// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/material_score.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

MaterialRule rule_of(const SceneView& scene) {
  std::vector<double> isos;
  for (const MaterialView& material : scene.materials) isos.push_back(material.iso);
  return MaterialRule(isos);
}

}  // namespace

MaterialScore::MaterialScore(const SceneView& scene, std::span<const VolumeContent> contents)
    : materials_(rule_of(scene).count()) {
  const MaterialRule rule = rule_of(scene);
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const VolumeView& view = scene.volumes[v];
    const auto& [density, labels] = contents[v];
    Volume& volume = volumes_.emplace_back();
    volume.bricks = view.bricks;
    volume.step_mm3 = std::abs(glm::determinant(glm::dmat3(view.world_from_voxel))) / kDensityMax;
    volume.material.resize(density.size());
    for (std::size_t i = 0; i < density.size(); ++i) {
      const Label label = labels.empty() ? Label{0} : labels[i];
      volume.material[i] = static_cast<Label>(rule.of(label, density[i]));
    }
    volume.matter.resize(volume.bricks.count() * materials_);
    volume.fullest.resize(volume.matter.size());
    volume.removed.resize(materials_);
    for (std::uint32_t brick = 0; brick < volume.bricks.count(); ++brick) {
      count(volume, density, brick);
    }
  }
}

void MaterialScore::update(std::size_t volume, std::span<const Density> density,
                           std::span<const std::uint32_t> bricks) {
  for (const std::uint32_t brick : bricks) count(volumes_[volume], density, brick);
}

void MaterialScore::count(Volume& volume, std::span<const Density> density,
                          std::uint32_t brick) const {
  std::uint32_t* const matter = &volume.matter[brick * materials_];
  std::uint32_t* const fullest = &volume.fullest[brick * materials_];
  for (std::size_t m = 0; m < materials_; ++m) volume.removed[m] -= fullest[m] - matter[m];
  std::fill_n(matter, materials_, 0U);
  const VoxelBox box = volume.bricks.voxels(brick);
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const std::size_t row = volume.bricks.grid.index(box.lo.x, y, z);
      const auto wide = static_cast<std::size_t>(box.hi.x - box.lo.x);
      for (std::size_t i = row; i < row + wide; ++i) matter[volume.material[i]] += density[i];
    }
  }
  for (std::size_t m = 0; m < materials_; ++m) {
    fullest[m] = std::max(fullest[m], matter[m]);
    volume.removed[m] += fullest[m] - matter[m];
  }
}

std::vector<double> MaterialScore::removed_mm3() const {
  std::vector<double> sums(materials_);
  for (const Volume& volume : volumes_) {
    for (std::size_t m = 0; m < materials_; ++m) {
      sums[m] += static_cast<double>(volume.removed[m]) * volume.step_mm3;
    }
  }
  return sums;
}

}  // namespace kerf
