// SPDX-License-Identifier: Apache-2.0
#pragma once

// What load time makes of a scene, as one number: the volumes' content, all samples of the tools
// and the speeds in air. It is computed in double, by operations that IEEE 754 fixes and
// elementary.hpp, so that processor, compiler and C library change nothing. The rest of a plan are
// fixed-point numbers of these and of the scene's settings, which the golden and the recorded runs
// step on.
#include <array>
#include <bit>
#include <cstdint>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/air_speed.hpp"
#include "controller/plan/compile.hpp"
#include "controller/tool/surface_samples.hpp"
#include "shared/numeric/fnv1a.hpp"

namespace kerf::test {

class LoadHash {
 public:
  void add(std::uint64_t word) { hash_ = fnv1a_step(hash_, word); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const std::array<double, 3>& v) {
    for (const double x : v) add(x);
  }
  void add(const PartSamples& part) {
    for (const auto& at : part.samples) add(at);
    for (const SurfaceSample& sample : part.close) {
      add(sample.at);
      add(sample.normal);
    }
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = kFnv1aBasis;
};

inline std::uint64_t load_hash(const LoadedScene& scene) {
  LoadHash hash;
  for (const SceneVolume& volume : scene.volumes) {
    for (const Density density : volume.image.density) hash.add(std::uint64_t{density});
    for (const Label label : volume.image.labels) hash.add(std::uint64_t{label});
    hash.add(std::uint64_t{volume.iso});
  }
  const bool swept = scene.force.model == ForceModel::proxy;
  for (const SceneTool& tool : scene.tools) {
    for (const ToolOffset& offset : tool.offsets) {
      for (const auto half_pitches : offset) hash.add(static_cast<std::uint64_t>(half_pitches));
    }
    if (!swept) continue;
    const double unit_mm = contact_unit_mm(scene);
    hash.add({surface_samples(tool, unit_mm), close_samples(tool, unit_mm)});
    for (const ToolPart& part : shaft_parts(tool)) {
      hash.add(part.middle_mm);
      hash.add(part_samples(tool, part, unit_mm));
    }
  }
  const auto plan = plan_scene(scene);
  for (const double speed : plan->costs().air_speeds_mm_per_s) hash.add(speed);
  return hash.value();
}

}  // namespace kerf::test
