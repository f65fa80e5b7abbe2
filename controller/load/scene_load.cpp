// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_load.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/load/felt_density.hpp"
#include "controller/load/load_tool.hpp"
#include "controller/load/scene_place.hpp"
#include "controller/scene/asked_to_end.hpp"
#include "controller/scene/materials.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_text.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/file/volume_limits.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "controller/volume/label_map.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/spacing_check.hpp"
#include "controller/volume/volume_crop.hpp"
#include "controller/volume/volume_denoise.hpp"
#include "controller/volume/volume_density.hpp"
#include "controller/volume/volume_noise.hpp"
#include "controller/volume/volume_proposal.hpp"

namespace kerf {
namespace {

constexpr double kPhantomVoxelMm = 0.125;  // of the default grid; other grids keep the tooth's size

/// The voxel edge that a tool's size in mm was written for, before --volume replaced the volume.
double written_voxel_mm(const VolumeSpec& volume) {
  if (volume.spacing_mm) {
    return *std::min_element(volume.spacing_mm->begin(), volume.spacing_mm->end());
  }
  if (!volume.phantom_size) return kPhantomVoxelMm;
  return kPhantomVoxelMm * PhantomSpec{}.grid.nx / volume.phantom_size->nx;
}

bool is_phantom(const VolumeSpec& volume) {
  return volume.file == kPhantomFile;
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
}

void apply_overrides(const SceneOverrides& overrides, Scene& scene) {
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
  if (is_phantom(first) && (overrides.spacing_mm || overrides.window)) {
    refuse(overrides.spacing_mm ? "--spacing" : "--window",
           ": the phantom has its own; leave the option out, or give a --volume");
  }
  if (overrides.spacing_mm) first.spacing_mm = overrides.spacing_mm;
  if (overrides.window) first.window = overrides.window;
  if (overrides.phantom_size) {
    for (VolumeSpec& volume : scene.volumes) {
      if (is_phantom(volume)) volume.phantom_size = overrides.phantom_size;
    }
  }
  scene.servo.rate_hz = overrides.rate_hz.value_or(scene.servo.rate_hz);
  scene.servo.numeric = overrides.numeric.value_or(scene.servo.numeric);
  scene.force.unchecked_gain = scene.force.unchecked_gain || overrides.unchecked_gain;
  if (overrides.personality && *overrides.personality != scene.device.personality) {
    scene.device.personality = *overrides.personality;
    scene.device.torque_scale.reset();  // of another device's motors
  }
  if (overrides.torque_scale) scene.device.torque_scale = overrides.torque_scale;
  if (scene.cut_in_one_tick) scene.cut.rate_per_s = scene.servo.rate_hz;
}

/// A spacing that makes no sense is told, where nobody has given one.
void tell_odd_spacing(const std::string& odd, const VolumeSpec& spec, SceneVolume& volume) {
  if (odd.empty() || spec.spacing_mm) return;
  volume.proposal.push_back("spacing=" + odd + "; give the true one with --spacing x,y,z (mm)");
}

/// Takes what is proposed for a volume of which the scene says nothing.
void propose(const SourceVolume& source, const VolumeSpec& spec, SceneVolume& volume) {
  ProposalWishes wishes;
  if (spec.window) wishes.window = {(*spec.window)[0], (*spec.window)[1]};
  ProposedVolume proposed = propose_volume(std::move(volume.image), range_window(source), wishes);
  const VolumeProposal& proposal = proposed.proposal;
  volume.image = std::move(proposed.image);
  volume.iso = nearest_density(proposal.density_of(proposal.iso) * kDensityMax);
  for (const ProposedMaterial& material : proposal.materials) {
    volume.proposed.push_back({.name = material.name,
                               .iso = proposal.density_of(material.from),
                               .colour = material.colour});
  }
  for (const ProposalLine& line : proposal_lines(proposal)) {
    volume.proposal.push_back(line.what + "=" + line.chosen);
  }
  tell_odd_spacing(odd_spacing(source, proposal.solid, proposal.surface.hounsfield), spec, volume);
}

/// Where a volume of which the scene says nothing is a map of labels alone, each is a material;
/// those beyond the `known` ones of the scene are added. Tells whether.
bool propose_labels(const SourceVolume& source, const VolumeSpec& spec, std::size_t known,
                    SceneVolume& volume) {
  if (spec.window || !take_label_map(source, volume.image, "")) return false;
  volume.iso = otsu_threshold(volume.image);
  const Label last = *std::ranges::max_element(volume.image.labels);
  for (std::size_t label = known; label <= last; ++label) {
    volume.proposed.push_back(label_material(label, volume.iso / kDensityMax));
  }
  volume.proposal.push_back("materials=by label, a map of labels alone; the highest is " +
                            std::to_string(last));
  constexpr bool kOftenOneMm = true;  // as a CT in HU is
  tell_odd_spacing(odd_spacing(source, solid_box(volume.image, volume.iso), kOftenOneMm), spec,
                   volume);
  return true;
}

/// Where a volume comes from.
struct VolumeSource {
  std::filesystem::path folder;
  bool unknown = false;  ///< the scene says nothing of it
  int cpu_s = 0;
  VolumeImage* image = nullptr;  ///< in place of the file, where given
};

/// The image of a volume and the density of its surface; the scene has `known` materials.
void load_image(const VolumeSpec& spec, const VolumeSource& from, std::size_t known,
                SceneVolume& volume) {
  if (from.image != nullptr) {
    volume.image = std::move(*from.image);
  } else if (is_phantom(spec)) {
    volume.image =
        make_phantom({.shape = spec.shape, .grid = spec.phantom_size.value_or(PhantomSpec{}.grid)});
  } else {
    const std::filesystem::path path = from.folder / spec.file;
    const SourceVolume source =
        read_volume(path, {.spacing_mm = spec.spacing_mm, .cpu_s = from.cpu_s});
    end_if_asked(path.string());
    const bool proposing = from.unknown && !std::filesystem::exists(labels_path(path));
    volume.image = apply_window(source, spec.window && !proposing
                                            ? Window{(*spec.window)[0], (*spec.window)[1]}
                                            : range_window(source));
    if (proposing) {
      if (!propose_labels(source, spec, known, volume)) propose(source, spec, volume);
      return;
    }
    read_labels_beside(path, volume.image, from.cpu_s);
  }
  volume.iso = spec.iso ? nearest_density(*spec.iso * kDensityMax) : otsu_threshold(volume.image);
}

bool none_is_labelled(const LoadedScene& scene) {
  return std::ranges::all_of(scene.volumes,
                             [](const SceneVolume& volume) { return volume.image.labels.empty(); });
}

/// A surface of a material's own needs to know where the material is.
void check_felt_materials(const LoadedScene& scene) {
  if (!none_is_labelled(scene)) return;
  for (const Material& material : scene.materials) {
    if (!material.felt_iso) continue;
    refuse(scene.path, ": material " + material.name +
                           " has felt_iso = " + number_text(*material.felt_iso) +
                           ", and no volume has labels to tell where it is; put them beside its "
                           "file (NAME-labels.nrrd), or leave felt_iso out");
  }
}

void check_labels(const VolumeImage& image, std::size_t materials) {
  Label highest = 0;
  for (const Label label : image.labels) highest = std::max(highest, label);  // many at a time
  if (image.labels.empty() || highest < materials) return;
  throw SceneError("label " + std::to_string(highest) + " stands for no material, the last is " +
                   std::to_string(materials - 1) + "; add a [[material]] for it");
}

static_assert(kMostDenoise == kMostPasses);

/// Neither has noise that can be told from its steps.
void refuse_steps(Denoise passes, const VolumeImage& image) {
  const std::string begin = "denoise: " + std::to_string(static_cast<int>(passes));
  if (is_label_map(image.grid, image.density)) {
    throw SceneError(begin + " for a label map, whose steps are no noise; leave it out");
  }
  const std::size_t levels = levels_of(image.density);
  if (levels >= kLeastLevels) return;
  throw SceneError(begin + " for a file of " + std::to_string(levels) +
                   " levels; noise can be told from " + std::to_string(kLeastLevels) +
                   " on, leave it out");
}

/// Finds the noise of a volume, and makes the passes against it that the scene asks for.
void denoise_volume(const VolumeSpec& spec, SceneVolume& volume) {
  VolumeImage& image = volume.image;
  if (spec.denoise > Denoise::off) refuse_steps(spec.denoise, image);
  if (!is_phantom(spec)) {  // which has none
    volume.noise = noise_of(image.grid, image.density, volume.iso);
  }
  volume.denoised = spec.denoise == Denoise::automatic ? passes_for(volume.noise)
                                                       : static_cast<int>(spec.denoise);
  if (volume.denoised == 0) return;
  // Labels may make solid what is softer.
  image = spec.crop && image.labels.empty() ? crop_for_passes(image, volume.iso, volume.denoised)
                                            : enclosed_in_air(std::move(image), volume.iso);
  denoise(image.grid, image.density, volume.denoised);
}

/// `felt_at`: the iso that the materials' `felt_iso` were written for; none: that of the volume.
SceneVolume load_volume(const VolumeSpec& spec, const VolumeSource& from,
                        std::vector<Material> materials, std::optional<double> felt_at) {
  SceneVolume volume;
  volume.name = spec.name;
  volume.file = spec.file;
  volume.solid = spec.solid;
  try {
    load_image(spec, from, materials.size(), volume);
    std::ranges::copy(volume.proposed, std::back_inserter(materials));
    end_if_asked(spec.file);
    check_labels(volume.image, materials.size());
    const VoxelGrid whole = volume.image.grid;
    denoise_volume(spec, volume);
    end_if_asked(spec.file);
    scale_to_felt_iso(materials, felt_at ? nearest_density(*felt_at * kDensityMax) : volume.iso,
                      volume.image);
    volume.image = spec.crop ? crop_to_solid(volume.image, volume.iso)
                             : enclosed_in_air(std::move(volume.image), volume.iso);
    if (spec.crop && !volume.proposal.empty()) fade_to_air(volume.image);
    volume.enclosed = !spec.crop && !(volume.image.grid == whole);
  } catch (const SceneError& error) {
    refuse(spec.where, std::string(": ") + error.what());
  }
  volume.pose = place_volume(volume.image,
                             spec.orientation ? rotation_of(*spec.orientation) : kSourceStanding,
                             spec.position_mm);
  const WorldBox box = world_box(volume);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double reach_mm = std::max(-box.lo_mm[axis], box.hi_mm[axis]);
    if (reach_mm <= kLargestWorldMm) continue;
    refuse(spec.where, ": the volume reaches " + short_text(reach_mm) +
                           " mm from the origin; keep it within " + number_text(kLargestWorldMm) +
                           ", check position_mm and spacing_mm");
  }
  return volume;
}

void add_proposed_materials(LoadedScene& scene) {
  std::ranges::copy(scene.volumes.front().proposed, std::back_inserter(scene.materials));
}

/// Where no voxel has a label, nobody knows of enamel or pulp: what is left is what the scene says
/// of densities, or, of a volume of --volume, what was proposed.
void leave_unlabelled_materials(bool of_command_line, LoadedScene& scene) {
  const auto first = scene.materials.begin() + 1;
  const auto left = std::remove_if(first, scene.materials.end(), [&](const Material& material) {
    return of_command_line || !material.in_scene;
  });
  scene.materials.erase(left, scene.materials.end());
  add_proposed_materials(scene);
}

/// Moves the materials' densities so that what began at the surface `from` begins at `to`; air and
/// full density stay where they are.
void move_materials(double from, double to, std::vector<Material>& materials) {
  for (Material& material : materials) {
    material.iso = material.iso < from ? material.iso * to / from
                                       : 1 - (1 - material.iso) * (1 - to) / (1 - from);
  }
}

/// The press of the hand, 1 / scale of it in the scene, takes the same share of a tool `grown`
/// times as large per second, and slows its spindle as much.
void fit_cutting(double grown, double scale, LoadedScene& scene) {
  scene.cut.machinability_mm3_per_s_n *= scale * grown * grown * grown;
  scene.cut.threshold_n /= scale;
  scene.spindle.stall_torque_n_mm *= grown / scale;
  scene.spindle.inertia_g_mm2 *= grown / scale;  // runs up in the same time
}

/// Fits a scene to its first volume; what is done is told in the header.
void fit_to_volume(double written_mm, Scene& spec, LoadedScene& scene) {
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
           ": the box needs a workspace scale of " + short_text(scale) + ", above the limit of " +
               number_text(kMaxWorkspaceScale) + "; check its spacing");
  }
  scene.device.workspace_scale = scale;
  fit_cutting(grown, scale, scene);
}

/// `first`: the image of the first volume, in place of its file.
LoadedScene load_parsed(Scene spec, const std::filesystem::path& path,
                        const SceneOverrides& overrides, VolumeImage* first) {
  const double written_mm =
      spec.device.fit ? kPhantomVoxelMm : written_voxel_mm(spec.volumes.front());
  const std::optional<double> written_iso = spec.volumes.front().iso;
  apply_overrides(overrides, spec);

  LoadedScene scene;
  static_cast<SceneSettings&>(scene) = spec;
  scene.volume_specs = spec.volumes;
  for (std::size_t i = 0; i < spec.volumes.size(); ++i) {
    const bool from_command_line = i == 0 && overrides.volume_file;
    const VolumeSource from{.folder = from_command_line ? "" : path.parent_path(),
                            .unknown = from_command_line,
                            .cpu_s = overrides.read_cpu_s,
                            .image = i == 0 ? first : nullptr};
    scene.volumes.push_back(load_volume(spec.volumes[i], from, scene.materials,
                                        from_command_line ? written_iso : std::nullopt));
  }
  check_felt_materials(scene);
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
  const TouchedVolumes touched = touched_volumes(scene.volumes);
  for (const ToolSpec& tool : spec.tools) {
    try {
      scene.tools.push_back(load_tool(tool, touched, path.parent_path(), overrides.read_cpu_s));
      scene.tool_specs.push_back(tool);
      scene.tool_specs.back().size.pitch_mm = scene.tools.back().pitch_mm;
      scene.tool_specs.back().size.radius_mm = scene.tools.back().radius_mm;
    } catch (const SceneError&) {
      // A spare tool of the scene that does not fit a volume that it was fitted to is nobody's
      // mistake.
      if (!fitted || scene.tools.empty()) throw;
    }
  }

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
  return scene;
}

}  // namespace

LoadedScene load_scene(const std::filesystem::path& path, const SceneOverrides& overrides) {
  return load_parsed(parse_scene_file(path, overrides.settings), path, overrides, nullptr);
}

LoadedScene load_scene(const std::filesystem::path& path, std::string_view text,
                       VolumeImage first) {
  return load_parsed(parse_scene(text, path), path, {}, &first);
}

double device_stiffness_n_per_mm(const LoadedScene& scene) {
  if (scene.force.model == ForceModel::proxy) return scene.force.stiffness_n_per_mm;
  const double scale = scene.device.workspace_scale;
  return scale * scale * 2 * std::numbers::pi * scene.tools[scene.active_tool].radius_mm *
         scene.force.p0_n_per_mm2;
}

double hand_unit_mm(const LoadedScene& scene) {
  return scene.tools[scene.active_tool].radius_mm / scene.device.workspace_scale /
         kReferenceRadiusMm;
}

}  // namespace kerf
