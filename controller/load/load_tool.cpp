// SPDX-License-Identifier: Apache-2.0
#include "controller/load/load_tool.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "controller/scene/scene_error.hpp"
#include "controller/scene/scene_text.hpp"
#include "controller/tool/mesh_tool.hpp"
#include "controller/tool/stl_file.hpp"
#include "controller/tool/tool_shaft.hpp"
#include "controller/tool/tool_shapes.hpp"

namespace kerf {
namespace {

void check_side(const ToolSpec& spec, double side_vox, const char* side, const char* way_out) {
  if (side_vox <= kMaxToolSide) return;
  refuse(spec.size_place, " makes a tool of " + short_text(side_vox) + " samples along " + side +
                              ", above the limit of " + std::to_string(kMaxToolSide) + "; " +
                              way_out);
}

/// The spindle turns about x = z = 0.
void check_axis(const ToolSpec& spec, const ToolMesh& mesh) {
  for (const auto& [axis, name] : {std::pair{std::size_t{0}, "x"}, {2, "z"}}) {
    const auto [low, high] = std::ranges::minmax_element(
        mesh.points_mm, {}, [i = axis](const ToolMesh::Point& p) { return p[i]; });
    const double low_mm = (*low)[axis], high_mm = (*high)[axis];
    if (low_mm < 0 && high_mm > 0) continue;
    refuse(spec.size_place, std::string(" lies beside its axis, the file's y: ") + name +
                                " goes from " + short_text(low_mm) + " to " + short_text(high_mm) +
                                " mm; move the mesh so that the spindle's axis is at x = z = 0");
  }
}

SceneTool load_shape(const ToolSpec& spec, const ToolSize& size, double voxel_mm) {
  if (!size.size_vox && size.radius_mm < voxel_mm / 2) {
    refuse(spec.size_place, " is below half a voxel (" + short_text(voxel_mm / 2) +
                                "); use a larger radius or a finer volume");
  }
  if (size.size_vox && *size.size_vox * size.pitch_mm < voxel_mm * (1 - 1e-9)) {
    refuse(spec.size_place, " makes a tool of " + short_text(*size.size_vox * size.pitch_mm) +
                                " mm, below a voxel (" + short_text(voxel_mm) +
                                "); use a larger one or a larger pitch_mm");
  }
  const double across_mm = 2 * size.radius_mm;
  const bool long_tool = !size.size_vox && size.length_mm.value_or(default_length_mm(
                                               spec.shape, size.radius_mm)) > across_mm;
  check_side(spec, tool_side_vox(spec.shape, size), long_tool ? "its length" : "a side",
             size.pitch_mm < voxel_mm ? "use a smaller tool or a coarser pitch"
                                      : "use a smaller tool or a coarser volume");
  return make_tool(spec.name, spec.shape, size);
}

SceneTool load_mesh(const ToolSpec& spec, double pitch_mm, double voxel_mm,
                    const std::filesystem::path& folder, int cpu_s) {
  const std::filesystem::path path = folder / spec.file;
  ToolMesh mesh;
  try {
    mesh = join_triangles(read_stl(path, cpu_s), spec.scale, path.string());
  } catch (const SceneError& error) {
    refuse(spec.where, std::string(": ") + error.what());
  }
  check_axis(spec, mesh);
  check_side(spec, mesh_side_vox(mesh, pitch_mm), "a side",
             "use a smaller scale (mm per unit of the file) or a coarser volume");
  SceneTool tool = make_mesh_tool(spec.name, std::move(mesh), pitch_mm);
  if (tool.radius_mm < voxel_mm / 2) {
    refuse(spec.size_place, " reaches less than half a voxel (" + short_text(voxel_mm / 2) +
                                " mm) from its axis; use a larger scale or a finer volume");
  }
  if (tool.offsets.empty()) {
    refuse(spec.size_place, " is so thin that no sample lies in it, they are " +
                                short_text(pitch_mm) +
                                " mm apart; give a smaller pitch_mm or a larger scale");
  }
  return tool;
}

/// The part of a shaft that the head hides is none.
void check_shaft(const ToolSpec& spec, const SceneTool& tool, double voxel_mm) {
  if (!spec.shaft.radius_mm) return;
  if (*spec.shaft.length_mm <= tool.length_mm * (1 + 1e-9)) {
    refuse(spec.shaft_place, " ends no farther than the head, which is " +
                                 short_text(tool.length_mm) +
                                 " mm long; it counts from the tool's tip, so use more");
  }
  if (*spec.shaft.radius_mm >= voxel_mm / 2) return;
  refuse(spec.shaft_place, " is of a shaft thinner than a voxel (" + short_text(voxel_mm) +
                               " mm); use a larger shaft_radius_mm or a finer volume");
}

}  // namespace

TouchedVolumes touched_volumes(const std::vector<SceneVolume>& volumes) {
  TouchedVolumes touched;
  for (const SceneVolume& volume : volumes) {
    if (!volume.solid) continue;
    const VolumeImage& image = volume.image;
    const std::array<std::int32_t, 3> extent = {image.grid.nx, image.grid.ny, image.grid.nz};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      touched.voxel_mm = std::min(touched.voxel_mm, image.spacing_mm[axis]);
      touched.side_mm = std::max(touched.side_mm, image.spacing_mm[axis] * extent[axis]);
    }
  }
  return touched;
}

SceneTool load_tool(const ToolSpec& spec, const TouchedVolumes& touched,
                    const std::filesystem::path& folder, int cpu_s) {
  ToolSize size = spec.size;
  if (!spec.pitch_given) {
    // Samples end inside of the surface by up to a pitch. Of that cell of the volume they then
    // leave as large a part, and what is more than half of it is felt and never cut
    // (docs/theory.md 6.3).
    const bool thin = !size.size_vox && size.radius_mm < touched.voxel_mm;
    size.pitch_mm = thin && spec.shape != kMeshShape ? touched.voxel_mm / 2 : touched.voxel_mm;
  }
  if (size.pitch_mm > touched.voxel_mm * (1 + 1e-9)) {
    refuse(spec.pitch_place, " is above the smallest voxel edge and leaves gaps; use at most " +
                                 number_text(touched.voxel_mm));
  }
  SceneTool tool = spec.shape == kMeshShape
                       ? load_mesh(spec, size.pitch_mm, touched.voxel_mm, folder, cpu_s)
                       : load_shape(spec, size, touched.voxel_mm);
  tool.turns = spec.turns;
  check_shaft(spec, tool, touched.voxel_mm);
  tool.shaft = tool_shaft(spec.shaft, tool.length_mm);
  const double side_mm = std::max(2 * tool.radius_mm, tool.length_mm);
  if (side_mm > touched.side_mm) {
    refuse(spec.size_place, " makes a tool of " + short_text(side_mm) + " mm" +
                                (tool.length_mm > 2 * tool.radius_mm ? " (its length)" : "") +
                                ", larger than the volume (" + short_text(touched.side_mm) +
                                " mm); use a smaller " +
                                (spec.shape == kMeshShape ? "scale" : "tool"));
  }
  return tool;
}

}  // namespace kerf
