// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/plan/plan_contact.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/tick_memory.hpp"
#include "controller/plan/tables/tool_points.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/tool/surface_samples.hpp"

namespace kerf {

/// Owner of what the swept contact needs: the tools' surfaces, room for their places in each volume
/// and the volumes' free bricks. Empty where the force is the paper's. Load time.
template <class N>
class ContactMemory {
 public:
  /// Samples of a tool's surface; they stay where they are.
  PointShell<N> hold_point_shell(const LoadedScene& scene, const SceneTool& tool) {
    const double unit_mm = contact_unit_mm(scene);
    const auto in_units = [unit_mm](std::vector<std::array<double, 3>> samples) {
      for (auto& sample : samples) {
        for (double& x : sample) x /= unit_mm;
      }
      return samples;
    };
    const auto samples = in_units(samples_of(scene, tool, unit_mm));
    const auto close = in_units(close_samples(tool, unit_mm));
    const auto& held =
        tools_.emplace_back(tool.name, ToolPoints<N>(samples, tool.round, close)).second;
    for (PlaceMemory<N>& places : places_) places.hold(held.point_shell());
    return held.point_shell();
  }

  /// Room in one more volume of the plan.
  void hold_volume(const SceneVolume& volume) {
    names_.push_back(volume.name);
    const VoxelGrid& grid = volume.image.grid;
    const auto bricks = [](std::int32_t voxels) {
      return static_cast<std::size_t>((voxels + kFreeBrick - 1) / kFreeBrick);
    };
    map_bytes_.push_back(bricks(grid.nx) * bricks(grid.ny) * bricks(grid.nz));
    places_.emplace_back();
  }

  /// What contact reads in volume `v` of the plan, whose densities are those of the servo.
  void take(const LoadedScene& scene, const SceneVolume& volume, std::size_t v,
            std::span<const Density> density, ContactState<N>& state) {
    const Density faintest = static_cast<Density>(volume.iso / 8);
    const FreeBrickMap& map = maps_.emplace_back(volume.image.grid, density, faintest);
    state.volumes[v] = {
        {volume.image.grid, density.data(), density_scale(volume.iso), map.bricks()},
        contact_frame<N>(scene, volume),
        places_[v].places()};
  }

  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    for (const auto& [name, tool] : tools_) {
      list.push_back({"surface of " + name, tool.bytes(), true});
    }
    for (std::size_t v = 0; v < names_.size(); ++v) {
      list.push_back({"places in " + names_[v], places_[v].bytes(), true});
      list.push_back({"free bricks of " + names_[v], map_bytes_[v], false});
    }
    return list;
  }

 private:
  static auto samples_of(const LoadedScene& scene, const SceneTool& tool, double unit_mm) {
    try {
      return surface_samples(tool, unit_mm);
    } catch (const SceneError& error) {
      throw SceneError(scene.path + ": " + error.what());
    }
  }

  std::vector<std::pair<std::string, ToolPoints<N>>> tools_;
  std::vector<std::string> names_;  ///< by volume of the plan
  std::vector<std::size_t> map_bytes_;
  std::vector<PlaceMemory<N>> places_;
  std::vector<FreeBrickMap> maps_;
};

}  // namespace kerf
