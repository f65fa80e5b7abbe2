// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/export_surface.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "shared/posix/new_file.hpp"
#include "visualizer/error.hpp"
#include "visualizer/surface/mesh_file.hpp"

namespace kerf {

namespace {

struct Format {
  std::string_view ending;
  std::string (*bytes)(const ClosedMesh&);
};
constexpr auto kFormats = std::to_array<Format>({{".stl", stl_bytes}, {".ply", ply_bytes}});

const Format& format_of(const std::filesystem::path& file) {
  const auto found = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) {
    return file.extension() == format.ending;
  });
  if (found != kFormats.end()) return *found;
  throw VisualizerError("--export: " + file.string() +
                        ": the name says no format; let it end in .stl or .ply");
}

}  // namespace

void check_export(const std::filesystem::path& file) {
  static_cast<void>(format_of(file));
  check_new_file(file);
}

void export_surface(const std::filesystem::path& file, const SceneView& scene,
                    std::span<const VolumeContent> contents) {
  const Format& format = format_of(file);
  const bool some_solid = scene.main_volume().solid;
  ClosedMesh mesh;
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    const VolumeView& volume = scene.volumes[i];
    if (some_solid ? !volume.solid : i != 0) continue;
    mesh.append(VolumeSurface(volume, scene.materials, contents[i].density, contents[i].labels),
                volume.world_from_voxel);
  }
  write_new_file(file, format.bytes(mesh));
}

}  // namespace kerf
