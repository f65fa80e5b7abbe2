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
#include "controller/tool/tool_shaft.hpp"

namespace kerf {

/// Owner of what the swept contact needs: the tools' surfaces, room for their places in each volume
/// and the volumes' free bricks. Empty where the force is the paper's. Load time.
template <class N>
class ContactMemory {
 public:
  /// Samples of a tool's surface; they stay where they are.
  PointShell<N> hold_point_shell(const LoadedScene& scene, const SceneTool& tool) {
    const double unit_mm = contact_unit_mm(scene);
    const auto samples = named(scene, [&] { return surface_samples(tool, unit_mm); });
    return hold(tool.name, unit_mm, {samples, close_samples(tool, unit_mm)}, tool.round, places_);
  }

  /// The same of what is behind the tool's head.
  PartsBehind<N> hold_parts_behind(const LoadedScene& scene, const SceneTool& tool) {
    const double unit_mm = contact_unit_mm(scene);
    PartsBehind<N> behind;
    for (const ToolPart& part : parts_behind(tool)) {
      const auto samples = named(scene, [&] { return part_samples(tool, part, unit_mm); });
      auto& places = places_behind_[behind.count];
      places.resize(places_.size());
      behind.part[behind.count++] = {
          hold(tool.name + "'s " + part.name, unit_mm, samples, false, places),
          typename N::Real(part.middle_mm / unit_mm)};
    }
    return behind;
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
    const MappedField& field = fields_.emplace_back(volume.image.grid, density, volume.iso);
    state.volumes[v] = {field.field(), contact_frame<N>(scene, volume), places_[v].places()};
    for (std::size_t part = 0; part < kMostBehind; ++part) {
      state.behind[part][v] = state.volumes[v];
      if (v < places_behind_[part].size()) {
        state.behind[part][v].places = places_behind_[part][v].places();
      }
    }
  }

  [[nodiscard]] std::vector<ArrayBytes> arrays() const {
    std::vector<ArrayBytes> list;
    for (const auto& [name, tool] : tools_) {
      list.push_back({"surface of " + name, tool.bytes(), true});
    }
    for (std::size_t v = 0; v < names_.size(); ++v) {
      std::size_t places = places_[v].bytes();
      for (const auto& behind : places_behind_) places += v < behind.size() ? behind[v].bytes() : 0;
      list.push_back({"places in " + names_[v], places, true});
      list.push_back({"free bricks of " + names_[v], map_bytes_[v], false});
    }
    return list;
  }

 private:
  /// With the scene's name before a complaint.
  static auto named(const LoadedScene& scene, const auto& make) {
    try {
      return make();
    } catch (const SceneError& error) {
      throw SceneError(scene.path + ": " + error.what());
    }
  }

  PointShell<N> hold(const std::string& name, double unit_mm, PartSamples mm, bool round,
                     std::vector<PlaceMemory<N>>& places) {
    for (auto& at : mm.samples) {
      for (double& x : at) x /= unit_mm;
    }
    for (SurfaceSample& sample : mm.close) {
      for (double& x : sample.at) x /= unit_mm;
    }
    const auto& held = tools_.emplace_back(name, ToolPoints<N>(mm.samples, round, mm.close)).second;
    for (PlaceMemory<N>& in_volume : places) in_volume.hold(held.point_shell());
    return held.point_shell();
  }

  std::vector<std::pair<std::string, ToolPoints<N>>> tools_;
  std::vector<std::string> names_;  ///< by volume of the plan
  std::vector<std::size_t> map_bytes_;
  std::vector<PlaceMemory<N>> places_;
  std::array<std::vector<PlaceMemory<N>>, kMostBehind> places_behind_;  ///< where a tool has a part
  std::vector<MappedField> fields_;
};

}  // namespace kerf
