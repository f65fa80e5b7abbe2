// SPDX-License-Identifier: Apache-2.0
#include "controller/load/load_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/tool/inner_samples.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "controller/volume/phantom.hpp"

namespace kerf {
namespace {

void check_side(const ToolSpec& spec, double side_vox, const char* side, const char* way_out) {
  if (side_vox <= kMaxToolSide) return;
  refuse(spec.size_location, " makes a tool of " + text_beside(side_vox, kMaxToolSide) +
                                 " samples along " + side + ", above the limit of " +
                                 std::to_string(kMaxToolSide) + "; " + way_out);
}

/// The spindle turns about x = z = 0.
void check_axis(const ToolSpec& spec, const ToolMesh& mesh) {
  for (const auto& [axis, name] : {std::pair{std::size_t{0}, "x"}, {2, "z"}}) {
    const auto [low, high] = std::ranges::minmax_element(
        mesh.points_mm, {}, [i = axis](const ToolMesh::Point& p) { return p[i]; });
    const double low_mm = (*low)[axis], high_mm = (*high)[axis];
    if (low_mm < 0 && high_mm > 0) continue;
    refuse(spec.size_location, std::string(" lies beside its axis, the file's y: ") + name +
                                   " goes from " + short_text(low_mm) + " to " +
                                   short_text(high_mm) +
                                   " mm; move the mesh so that the spindle's axis is at x = z = 0");
  }
}

SceneTool load_shape(const ToolSpec& spec, const ToolSize& size, double voxel_mm) {
  if (!size.size_vox && size.radius_mm < voxel_mm / 2) {
    refuse(spec.size_location, " is below half a voxel (" + short_text(voxel_mm / 2) +
                                   "); use a larger radius or a finer volume");
  }
  if (size.size_vox && *size.size_vox * size.pitch_mm < voxel_mm * (1 - 1e-9)) {
    refuse(spec.size_location, " makes a tool of " +
                                   text_beside(*size.size_vox * size.pitch_mm, voxel_mm) +
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
                    const MeshSource& from) {
  const std::filesystem::path path = from.folder / spec.file;
  ToolMesh mesh;
  try {
    if (from.mesh != nullptr) {
      mesh = *from.mesh;
      check_mesh(mesh, "the recorded mesh");
    } else {
      mesh = join_triangles(read_stl(path, from.cpu_s), spec.scale, path.string());
    }
  } catch (const LoadError& error) {
    refuse(spec.where, std::string(": ") + error.what());
  }
  check_axis(spec, mesh);
  check_side(spec, mesh_side_vox(mesh, pitch_mm), "a side",
             "use a smaller scale (mm per unit of the file) or a coarser volume");
  SceneTool tool = make_mesh_tool(spec.name, std::move(mesh), pitch_mm);
  if (tool.radius_mm < voxel_mm / 2) {
    refuse(spec.size_location, " reaches less than half a voxel (" + short_text(voxel_mm / 2) +
                                   " mm) from its axis; use a larger scale or a finer volume");
  }
  if (tool.offsets.empty()) {
    refuse(spec.size_location, " is so thin that no sample lies in it, they are " +
                                   short_text(pitch_mm) +
                                   " mm apart; give a smaller pitch_mm or a larger scale");
  }
  return tool;
}

/// Refuses a shaft that the head hides, and one thinner than a voxel.
void check_shaft(const ToolSpec& spec, const SceneTool& tool, double voxel_mm) {
  if (!spec.shaft.radius_mm) return;
  if (*spec.shaft.length_mm <= tool.length_mm * (1 + 1e-9)) {
    refuse(spec.shaft_location, " ends no farther than the head, which is " +
                                    short_text(tool.length_mm) +
                                    " mm long; it counts from the tool's tip, so use more");
  }
  if (*spec.shaft.radius_mm >= voxel_mm / 2) return;
  refuse(spec.shaft_location, " is of a shaft thinner than a voxel (" + short_text(voxel_mm) +
                                  " mm); use a larger shaft_radius_mm or a finer volume");
}

}  // namespace

SolidExtent touched_volumes(const std::vector<SceneVolume>& volumes) {
  SolidExtent touched;
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

SceneTool load_tool(const ToolSpec& spec, const SolidExtent& touched, const MeshSource& from) {
  ToolSize size = spec.size;
  if (!spec.pitch_given) {
    // Samples end inside of the surface by up to a pitch, and leave as large a part of that cell of
    // the volume; if that is more than half, the tool rests on it and never cuts it
    // (docs/forces.md 6.3).
    const bool thin = !size.size_vox && size.radius_mm < touched.voxel_mm;
    size.pitch_mm = thin && spec.shape != kMeshShape ? touched.voxel_mm / 2 : touched.voxel_mm;
  }
  if (size.pitch_mm > touched.voxel_mm * (1 + 1e-9)) {
    refuse(spec.pitch_location, " is above the smallest voxel edge and leaves gaps; use at most " +
                                    number_text(touched.voxel_mm));
  }
  SceneTool tool = spec.shape == kMeshShape ? load_mesh(spec, size.pitch_mm, touched.voxel_mm, from)
                                            : load_shape(spec, size, touched.voxel_mm);
  tool.turns = spec.turns;
  tool.law = spec.law;
  check_shaft(spec, tool, touched.voxel_mm);
  tool.shaft = tool_shaft(spec.shaft, tool.length_mm);
  const double side_mm = std::max(2 * tool.radius_mm, tool.length_mm);
  if (side_mm > touched.side_mm) {
    refuse(spec.size_location, " makes a tool of " + text_beside(side_mm, touched.side_mm) + " mm" +
                                   (tool.length_mm > 2 * tool.radius_mm ? " (its length)" : "") +
                                   ", larger than the volume (" + short_text(touched.side_mm) +
                                   " mm); use a smaller " +
                                   (spec.shape == kMeshShape ? "scale" : "tool"));
  }
  return tool;
}

namespace {

constexpr double kPhantomVoxelMm = 0.125;  // of the default grid; other grids keep the tooth's size

/// The voxel edge for which the sizes of tools were written, before --volume replaced the volume.
double written_voxel_mm(const VolumeSpec& volume) {
  for (const auto& spacing_mm : {volume.override_spacing_mm, volume.spacing_mm}) {
    if (spacing_mm) return std::ranges::min(*spacing_mm);
  }
  if (!volume.phantom_size) return kPhantomVoxelMm;
  return kPhantomVoxelMm * PhantomSpec{}.grid.nx / volume.phantom_size->nx;
}

void check_overrides(const SceneOverrides& overrides) {
  if (overrides.rate_hz && (*overrides.rate_hz < kMinRateHz || *overrides.rate_hz > kMaxRateHz)) {
    refuse("--rate " + std::to_string(*overrides.rate_hz), " is out of range; use " +
                                                               std::to_string(kMinRateHz) + " to " +
                                                               std::to_string(kMaxRateHz));
  }
  if (overrides.window && !((*overrides.window)[0] < (*overrides.window)[1])) {
    refuse("--window", " is empty; write low,high with low < high");
  }
  if (overrides.spacing_mm) check_spacing("--spacing", *overrides.spacing_mm);
  if (overrides.override_spacing_mm) {
    check_spacing("--override-spacing", *overrides.override_spacing_mm);
  }
}

/// Kind and torque scale of one device or of both.
void replace_devices(const SceneOverrides& overrides, SceneSpec& scene) {
  const auto replace = [&](DeviceSettings& device,
                           const std::optional<std::array<double, 3>>& torque_scale) {
    if (overrides.personality && *overrides.personality != device.personality) {
      if (!device.identified.empty()) {
        refuse("--device " + std::string(word_of(*overrides.personality)),
               ": the scene's device.identified is of its " +
                   std::string(word_of(device.personality)) +
                   "; leave the option out, or give --set device.personality");
      }
      device.personality = *overrides.personality;
      device.torque_scale.reset();  // of another device's motors
    }
    if (torque_scale) device.torque_scale = torque_scale;
  };
  replace(scene.device, overrides.torque_scale);
  if (overrides.second_torque_scale && !scene.second) {
    refuse("--torque-scale", " has six numbers, and the scene has one [device]; give three");
  }
  if (scene.second) {
    const Personality first = scene.device.personality;
    const bool same = overrides.personality || scene.second->device.personality == first;
    if (overrides.torque_scale && !overrides.second_torque_scale && !same) {
      refuse("--torque-scale",
             " has three numbers, and the scene has two devices of different kinds; give six");
    }
    replace(scene.second->device,
            overrides.second_torque_scale ? overrides.second_torque_scale : overrides.torque_scale);
  }
}

void apply_overrides(const SceneOverrides& overrides, SceneSpec& scene) {
  check_overrides(overrides);
  VolumeSpec& first = scene.volumes.front();
  if (overrides.volume_file) {
    VolumeSpec replaced;
    replaced.where = "--volume";
    replaced.file = overrides.volume_file->string();
    replaced.name = overrides.volume_file->stem().string();
    replaced.denoise = first.denoise;
    replaced.crop = first.crop;
    replaced.position_mm = first.position_mm;
    replaced.orientation = first.orientation;
    first = replaced;
    scene.offset_given = false;
  }
  for (const auto& [option, given] :
       {std::pair{"--spacing", overrides.spacing_mm.has_value()},
        {"--override-spacing", overrides.override_spacing_mm.has_value()},
        {"--window", overrides.window.has_value()}}) {
    if (!given || !is_phantom(first)) continue;
    refuse(option, ": the phantom has its own; leave the option out, or give a --volume");
  }
  // Either option replaces both keys of the scene.
  if (overrides.spacing_mm || overrides.override_spacing_mm) {
    first.spacing_mm = overrides.spacing_mm;
    first.override_spacing_mm = overrides.override_spacing_mm;
  }
  if (overrides.window) first.window = overrides.window;
  if (overrides.phantom_size) {
    for (VolumeSpec& volume : scene.volumes) {
      if (is_phantom(volume)) volume.phantom_size = overrides.phantom_size;
    }
  }
  scene.servo.rate_hz = overrides.rate_hz.value_or(scene.servo.rate_hz);
  scene.servo.numeric = overrides.numeric.value_or(scene.servo.numeric);
  scene.force.unchecked_gain = scene.force.unchecked_gain || overrides.unchecked_gain;
  replace_devices(overrides, scene);
  settle_device(scene);
  if (scene.cut.pedal == CutPedal::automatic && overrides.pedal) {
    scene.cut.pedal = CutPedal::button;
  }
  if (scene.cut_in_one_tick) scene.cut.rate_per_s = scene.servo.rate_hz;
}

bool none_is_labelled(const LoadedScene& scene) {
  return std::ranges::all_of(scene.volumes,
                             [](const SceneVolume& volume) { return volume.image.labels.empty(); });
}

/// A surface of a material's own, and its protection, need labels.
void check_labelled_materials(const LoadedScene& scene) {
  if (!none_is_labelled(scene)) return;
  const auto need_labels = [&](const Material& material, const std::string& key,
                               const std::string& value) {
    refuse(scene.path, ": material " + material.name + " has " + key + " = " + value +
                           ", and no volume has labels to tell where it is; put them beside its "
                           "file (NAME-labels.nrrd), or leave " +
                           key + " out");
  };
  for (const Material& material : scene.materials) {
    if (material.felt_iso) need_labels(material, "felt_iso", number_text(*material.felt_iso));
    if (material.forbidden) need_labels(material, "forbidden", "true");
  }
}

/// A material of the scene without a voxel shows and protects nothing: its name is a slip. Below
/// the highest label it may stand for a label that this file lacks, unless it shall be protected.
void check_material_names(const LoadedScene& scene) {
  std::vector<bool> there(scene.materials.size());
  for (const SceneVolume& volume : scene.volumes) {
    for (const Label label : volume.image.labels) there[label] = true;
  }
  std::vector<std::string_view> known;
  std::size_t highest = 0;
  for (std::size_t m = 1; m < there.size(); ++m) {
    if (!there[m]) continue;
    known.push_back(scene.materials[m].name);
    highest = m;
  }
  for (std::size_t m = 1; m < there.size(); ++m) {
    const Material& material = scene.materials[m];
    if (!material.in_scene || there[m] || (m < highest && !material.forbidden)) continue;
    refuse(scene.path, ": material.name = \"" + material.name + '"' +
                           unknown_word(material.name, known, "\"") +
                           ", the materials of which its volumes have voxels");
  }
}

void add_proposed_materials(LoadedScene& scene) {
  std::ranges::copy(scene.volumes.front().proposed, std::back_inserter(scene.materials));
}

/// Without labels enamel and pulp are unknown: only the materials of the scene stay, or, for a
/// volume of
/// --volume, the proposed ones.
void leave_unlabelled_materials(bool of_command_line, LoadedScene& scene) {
  const auto first = scene.materials.begin() + 1;
  const auto left = std::remove_if(first, scene.materials.end(), [&](const Material& material) {
    return of_command_line || !material.in_scene;
  });
  scene.materials.erase(left, scene.materials.end());
  add_proposed_materials(scene);
}

/// Moves the materials' densities so that the surface at `from` comes to `to`; air and full density
/// stay.
void move_materials(double from, double to, std::vector<Material>& materials) {
  for (Material& material : materials) {
    material.iso = material.iso < from ? material.iso * to / from
                                       : 1 - (1 - material.iso) * (1 - to) / (1 - from);
  }
}

/// The press of the hand, 1 / scale of it in the scene, removes the same fraction of a tool `grown`
/// times as large per second, and slows its spindle as much.
void fit_cutting(double grown, double scale, LoadedScene& scene) {
  scene.cut.machinability_mm3_per_s_n *= scale * grown * grown * grown;
  scene.cut.threshold_n /= scale;
  scene.cut.reference_n /= scale;
  scene.spindle.stall_torque_n_mm *= grown / scale;
  scene.spindle.inertia_g_mm2 *= grown / scale;  // runs up in the same time
}

/// Fits a scene to its first volume, as the header describes.
void fit_to_volume(double written_mm, SceneSpec& spec, LoadedScene& scene) {
  const double grown = touched_volumes(scene.volumes).voxel_mm / written_mm;
  for (ToolSpec& tool : spec.tools) {
    tool.size.radius_mm *= grown;
    tool.size.pitch_mm *= grown;
    ShaftSize& shaft = tool.shaft;
    for (auto* length_mm : {&tool.size.length_mm, &shaft.radius_mm, &shaft.length_mm,
                            &shaft.handpiece_radius_mm, &shaft.handpiece_length_mm}) {
      if (*length_mm) **length_mm *= grown;
    }
    tool.scale *= grown;
  }
  const WorldBox box = world_box(scene.volumes.front());
  double scale = kMinWorkspaceScale;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scale = std::max(scale, (box.hi_mm[axis] - box.lo_mm[axis]) / kWorkspaceMm[axis]);
  }
  if (scale > kMaxWorkspaceScale) {
    refuse(scene.volume_specs.front().where,
           ": the box needs a workspace scale of " + text_beside(scale, kMaxWorkspaceScale) +
               ", above the limit of " + number_text(kMaxWorkspaceScale) + "; check its spacing");
  }
  scene.device.workspace_scale = scale;
  fit_cutting(grown, scale, scene);
  for (ToolSpec& tool : spec.tools) {
    tool.law.saturation_n /= scale;
    tool.law.wear_half_n_s /= scale;
  }
}

/// Index of the tool that a device holds at the start. One that a fitted scene has left out, or
/// `otherwise` beyond the list, is the first.
std::size_t tool_held(const DeviceSettings& device, std::size_t otherwise,
                      const std::vector<SceneTool>& tools) {
  const auto named = std::ranges::find(tools, device.first_tool, &SceneTool::name);
  if (named != tools.end()) return static_cast<std::size_t>(named - tools.begin());
  return device.first_tool.empty() && otherwise < tools.size() ? otherwise : 0;
}

const ToolMesh* mesh_of(const std::string& tool, const RecordedInputs& recorded) {
  const auto found =
      std::ranges::find(recorded.meshes, tool, &std::pair<std::string, ToolMesh>::first);
  return found == recorded.meshes.end() ? nullptr : &found->second;
}

/// How far the second device's origin lies from the first one's, mm of the hands; 0 unless the
/// scene says both.
Point3 arms_apart_mm(const SceneSpec& spec) {
  Point3 apart_mm{};
  if (!spec.second || !spec.offset_given || !spec.second->offset_given) return apart_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    apart_mm[axis] = (spec.second->device.offset_mm[axis] - spec.device.offset_mm[axis]) /
                     spec.device.workspace_scale;
  }
  return apart_mm;
}

/// Gives the second arm its tool, the scale of the first, and its position: as written, or over the
/// first one's; of a volume of the command line, which has its own size, as far from that as
/// before.
void finish_second_arm(const Point3& apart_mm, bool of_command_line, LoadedScene& scene) {
  if (!scene.second) return;
  DeviceSettings& second = scene.second->device;
  scene.second_tool = tool_held(second, 1, scene.tools);
  second.workspace_scale = scene.device.workspace_scale;
  second.fit = scene.device.fit;
  if (scene.second->offset_given && !of_command_line) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double scene_mm = of_command_line ? apart_mm[axis] * second.workspace_scale : 0;
    second.offset_mm[axis] = scene.device.offset_mm[axis] + scene_mm;
  }
}

/// Of `device.identified`, at the scene's rate.
std::optional<IdentifiedDevice> identified_device(const DeviceSettings& device, int rate_hz) {
  if (device.identified.empty()) return std::nullopt;
  try {
    const IdentifiedDevice found = read_identified_device(device.identified);
    if (found.most_delay_s * rate_hz < kMostIdentifiedPeriods) return found;
  } catch (const DeviceFileError& error) {
    throw LoadError(error.what());
  }
  refuse(device.identified, ": device.delay_s is 64 periods and more at servo.rate_hz = " +
                                std::to_string(rate_hz) + "; lower the rate");
}

void load_tools(const SceneSpec& spec, const std::filesystem::path& folder,
                const SceneOverrides& overrides, const RecordedInputs& recorded, bool fitted,
                LoadedScene& scene) {
  const SolidExtent touched = touched_volumes(scene.volumes);
  for (const ToolSpec& tool : spec.tools) {
    try {
      scene.tools.push_back(
          load_tool(tool, touched, {folder, overrides.read_cpu_s, mesh_of(tool.name, recorded)}));
      scene.tool_specs.push_back(tool);
      scene.tool_specs.back().size.pitch_mm = scene.tools.back().pitch_mm;
      scene.tool_specs.back().size.radius_mm = scene.tools.back().radius_mm;
    } catch (const LoadError&) {
      // A spare tool may not fit the volume to which the scene was fitted.
      if (!fitted || scene.tools.empty()) throw;
    }
  }
}

/// `first`: the image of the first volume, in place of its file.
LoadedScene load_parsed(SceneSpec spec, const std::filesystem::path& path,
                        const SceneOverrides& overrides, VolumeImage* first,
                        RecordedInputs recorded = {}) {
  const double written_mm =
      spec.device.fit ? kPhantomVoxelMm : written_voxel_mm(spec.volumes.front());
  const std::optional<double> written_iso = spec.volumes.front().iso;
  const Point3 apart_mm = arms_apart_mm(spec);
  apply_overrides(overrides, spec);

  LoadedScene scene;
  static_cast<SceneSettings&>(scene) = spec;
  scene.volume_specs = spec.volumes;
  for (std::size_t i = 0; i < spec.volumes.size(); ++i) {
    const bool from_command_line = i == 0 && overrides.volume_file;
    const VolumeSource from{.folder = from_command_line ? "" : path.parent_path(),
                            .unknown = from_command_line,
                            .cpu_s = overrides.read_cpu_s,
                            .image = i == 0 ? first : nullptr,
                            .recorded = i < recorded.volumes.size() && recorded.volumes[i]
                                            ? &*recorded.volumes[i]
                                            : nullptr};
    scene.volumes.push_back(load_volume(spec.volumes[i], from, scene.materials,
                                        from_command_line ? written_iso : std::nullopt));
  }
  // A volume of the command line is not the one that the scene was written for.
  if (!overrides.volume_file) check_labelled_materials(scene);
  if (!overrides.volume_file && !none_is_labelled(scene)) check_material_names(scene);
  const bool fitted = overrides.volume_file.has_value() || spec.device.fit;
  if (fitted) fit_to_volume(written_mm, spec, scene);
  if (none_is_labelled(scene)) {
    leave_unlabelled_materials(overrides.volume_file.has_value(), scene);
  } else if (overrides.volume_file) {
    if (written_iso && *written_iso > 0 && *written_iso < 1) {
      move_materials(*written_iso, scene.volumes.front().iso / kDensityMax, scene.materials);
    }
    if (!scene.volumes.front().image.labels.empty()) add_proposed_materials(scene);
  }
  load_tools(spec, path.parent_path(), overrides, recorded, fitted, scene);
  scene.active_tool = tool_held(scene.device, 0, scene.tools);
  if (fitted) {
    const double scale = scene.device.workspace_scale;
    const double weaker =
        kReferenceRadiusMm / (scale * scale * scene.tools[scene.active_tool].radius_mm);
    scene.force.p0_n_per_mm2 *= weaker;
    scene.cut.p1_n_per_mm2 *= weaker;
  }
  if (!spec.offset_given) {
    scene.device.offset_mm = first_surface_from_above(*std::find_if(
        scene.volumes.begin(), scene.volumes.end(), [](const SceneVolume& v) { return v.solid; }));
  }
  finish_second_arm(apart_mm, overrides.volume_file.has_value(), scene);
  if (recorded.without_device_file) return scene;
  scene.identified = identified_device(scene.device, scene.servo.rate_hz);
  if (scene.second) {
    scene.second_identified = identified_device(scene.second->device, scene.servo.rate_hz);
  }
  return scene;
}

}  // namespace

LoadedScene load_scene(const std::filesystem::path& path, const SceneOverrides& overrides) {
  return load_scene(path, read_scene_text(path), overrides);
}

LoadedScene load_scene(const std::filesystem::path& path, std::string_view text,
                       const SceneOverrides& overrides, RecordedInputs recorded) {
  return load_parsed(parse_scene(text, path, scene_keys(), overrides.settings), path, overrides,
                     nullptr, std::move(recorded));
}

LoadedScene load_scene(const std::filesystem::path& path, std::string_view text, VolumeImage first,
                       const SceneOverrides& overrides) {
  return load_parsed(parse_scene(text, path, scene_keys(), overrides.settings), path, overrides,
                     &first);
}

double device_stiffness_n_per_mm(const LoadedScene& scene) {
  if (scene.force.model != ForceModel::paper) return scene.force.stiffness_n_per_mm;
  const double scale = scene.device.workspace_scale;
  return scale * scale * 2 * std::numbers::pi * scene.tools[scene.active_tool].radius_mm *
         scene.force.p0_n_per_mm2;
}

double hand_unit_mm(const LoadedScene& scene) {
  return scene.tools[scene.active_tool].radius_mm / scene.device.workspace_scale /
         kReferenceRadiusMm;
}

}  // namespace kerf
