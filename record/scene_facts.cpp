// SPDX-License-Identifier: Apache-2.0
#include "record/scene_facts.hpp"

#include <algorithm>
#include <cmath>

#include "record/tick_log.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/brick_grid.hpp"

namespace kerf {
namespace {

constexpr int kNsPerS = 1'000'000'000;

SceneFacts::Volume volume_in(const Json& json) {
  return {.name = one_line(json.at("name").get<std::string>()),
          .density_hash = json.at("density_hash").get<std::string>(),
          .size_vox = json.at("grid").get<std::array<std::int32_t, 3>>(),
          .spacing_mm = json.at("spacing_mm").get<std::array<double, 3>>()};
}

/// Calls `read`; whether the scene has what it reads.
template <class Read>
bool has(const Read& read) {
  try {
    read();
    return true;
  } catch (const JsonError&) {
    return false;
  }
}

/// Whether there can be such a volume: a scene may be foreign, and its size is allocated.
bool is_possible_volume(const SceneFacts::Volume& volume) {
  constexpr std::uint64_t kMost = std::uint64_t{kMaxBricks} * kBrickVoxels;
  std::uint64_t voxels = 1;
  for (const std::int32_t edge : volume.size_vox) {
    if (edge < 1 || static_cast<std::uint64_t>(edge) > kMost / voxels) return false;
    voxels *= static_cast<std::uint64_t>(edge);
  }
  return std::ranges::all_of(volume.spacing_mm,
                             [](double mm) { return std::isfinite(mm) && mm > 0; });
}

}  // namespace

SceneFacts scene_facts(std::string_view scene_json) {
  const Json scene = Json::parse(scene_json);
  SceneFacts out;
  out.config_hash = hex64(fnv1a(scene.without("source").canonical()));
  if (scene.contains("device")) out.arms = scene.contains("second_device") ? 2 : 1;
  has([&] {
    const auto rate_hz = scene.at("servo").at("rate_hz").get<std::int32_t>();
    if (rate_hz > 0) out.tick_ns = static_cast<std::uint32_t>(kNsPerS / rate_hz);
  });
  const bool has_volumes = has([&] {
    for (const Json& volume : scene.at("volumes")) out.volumes.push_back(volume_in(volume));
  });
  if (!has_volumes || !std::ranges::all_of(out.volumes, is_possible_volume)) out.volumes.clear();
  return out;
}

void take_facts(const SceneFacts& scene, Manifest& manifest) {
  manifest.arms = scene.arms.value_or(manifest.arms);
  if (scene.tick_ns) manifest.tick_ns = *scene.tick_ns;
  if (scene.volumes.empty()) return;
  manifest.voxel_mm3.clear();
  for (const auto& [name, hash, size, mm] : scene.volumes) {
    manifest.voxel_mm3.push_back(mm[0] * mm[1] * mm[2]);
  }
}

Manifest read_facts(const std::filesystem::path& folder) {
  Manifest manifest = read_manifest(folder);
  try {
    take_facts(scene_facts(recorded_scene(folder)), manifest);
  } catch (const JsonError&) {    // NOLINT(bugprone-empty-catch): see above
  } catch (const RecordError&) {  // NOLINT(bugprone-empty-catch): see above
  }
  return manifest;
}

}  // namespace kerf
