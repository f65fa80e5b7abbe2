// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/scene_segment.hpp"

#include <cstddef>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>

namespace kerf {
namespace {

/// Bytes that programs can still take before the system runs out, by the kernel's own estimate
/// (MemAvailable); nothing where it does not tell.
std::optional<std::uint64_t> available_memory() {
  std::ifstream table("/proc/meminfo");
  std::string name;
  std::uint64_t kib = 0;
  while (table >> name >> kib) {
    if (name == "MemAvailable:") return kib << 10;
    table.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::nullopt;
}

}  // namespace

SegmentSpec segment_spec(const LoadedScene& scene, const std::string& json, std::uint64_t hash) {
  SegmentSpec spec;
  spec.scene_json = json;
  spec.config_hash = hash;
  spec.tick_ns = static_cast<std::uint32_t>(1'000'000'000 / scene.servo.rate_hz);
  spec.build_id = std::string("kerf-controller ") + KERF_VERSION;
  spec.mirror_updates = scene.cut.model != CutModel::none;
  for (const SceneVolume& volume : scene.volumes) {
    SegmentVolumeSpec& v = spec.volumes.emplace_back();
    v.grid = volume.image.grid;
    v.spacing_mm = volume.image.spacing_mm;
    v.origin_mm = volume.pose.position_mm;
    for (std::size_t i = 0; i < 4; ++i) {
      v.orientation[i] = static_cast<float>(volume.pose.orientation[i]);
    }
    v.iso = volume.iso;
    v.density = volume.image.density;
    v.labels = volume.image.labels;
  }
  return spec;
}

void check_memory(const LoadedScene& scene, const SceneCosts& costs, std::uint64_t segment_bytes) {
  std::uint64_t bytes = segment_bytes;
  for (const ArrayBytes& array : costs.arrays) bytes += array.taken ? 0 : array.bytes;
  const auto free_bytes = available_memory();
  if (free_bytes && bytes > *free_bytes) {
    throw std::runtime_error(scene.path + ": needs " + std::to_string(bytes >> 20) + " MiB, and " +
                             std::to_string(*free_bytes >> 20) +
                             " MiB are free; crop or resample the volume with kerf-volume");
  }
}

}  // namespace kerf
