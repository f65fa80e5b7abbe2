// SPDX-License-Identifier: Apache-2.0
// One volume of a scene: reads or makes it, proposes what the scene leaves open, smooths, crops and
// places it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/volume/crop_resample.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/volume_proposal.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/posix/program.hpp"

namespace kerf {
namespace {

/// Adds the doubt about a spacing to the proposal, unless the scene gives one.
void add_odd_spacing(const std::string& odd, const VolumeSpec& spec, SceneVolume& volume) {
  if (odd.empty() || spec.spacing_mm || spec.override_spacing_mm) return;
  volume.proposal.push_back("spacing=" + odd);
}

/// Takes the proposal for a volume of which the scene has no settings.
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
  add_odd_spacing(odd_spacing(source, proposal.solid, proposal.surface.hounsfield), spec, volume);
}

/// If a volume of which the scene has no settings is a map of labels alone, each is a material;
/// those beyond the `known` ones of the scene are added. Returns whether it is one.
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
  add_odd_spacing(odd_spacing(source, solid_box(volume.image, volume.iso), kOftenOneMm), spec,
                  volume);
  return true;
}

/// Where the file of a scene of kerf's own may lie in the user's data folder; empty for another
/// scene.
std::filesystem::path path_in_user_data(const std::filesystem::path& folder,
                                        const std::string& file) {
  std::error_code fault;
  const std::string shipped = find_beside_program("scenes"), data = user_data_folder();
  if (shipped.empty() || data.empty()) return {};
  const std::filesystem::path below = std::filesystem::relative(
      folder.empty() ? std::filesystem::path(".") : folder, shipped, fault);
  if (fault || below.empty() || below.begin()->string() == "..") return {};
  return (std::filesystem::path(data) / "scenes" / below / file).lexically_normal();
}

/// The image of a volume and the density of its surface; the scene has `known` materials.
void load_image(const VolumeSpec& spec, const VolumeSource& from, std::size_t known,
                SceneVolume& volume) {
  if (from.image != nullptr) {
    volume.image = std::move(*from.image);
  } else if (is_phantom(spec)) {
    volume.image =
        make_phantom({.shape = spec.shape, .grid = spec.phantom_size.value_or(PhantomSpec{}.grid)});
  } else {
    const std::filesystem::path path =
        from.unknown ? std::filesystem::path(spec.file) : volume_path(from.folder, spec.file);
    std::error_code fault;
    if (!from.unknown && !std::filesystem::exists(path, fault) && !fault) {
      const std::filesystem::path own = path_in_user_data(from.folder, spec.file);
      throw LoadError(path.string() +
                      ": no such file or folder; check the path, or get it as the comment at the "
                      "top of the scene says" +
                      (own.empty() ? "" : ", here or as " + own.string()));
    }
    const SourceVolume source = read_volume(path, {.spacing_mm = spec.spacing_mm,
                                                   .override_spacing_mm = spec.override_spacing_mm,
                                                   .cpu_s = from.cpu_s});
    volume.note = source.note;
    if (!source.axes_note.empty()) {
      volume.note += (volume.note.empty() ? "axes " : "; axes ") + source.axes_note +
                     "; import --axes gives others";
    }
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

void check_labels(const VolumeImage& image, std::size_t materials) {
  Label highest = 0;
  for (const Label label : image.labels) highest = std::max(highest, label);  // many at a time
  if (image.labels.empty() || highest < materials) return;
  throw LoadError("label " + std::to_string(highest) + " stands for no material, the last is " +
                  std::to_string(materials - 1) + "; add a [[material]] for it");
}

static_assert(kMostDenoise == kMostPasses);

/// Refuses to denoise a label map, or an image with so few grey levels that noise cannot be
/// distinguished from quantisation.
void refuse_steps(Denoise passes, const VolumeImage& image) {
  const std::string begin = "denoise: " + std::to_string(static_cast<int>(passes));
  if (is_label_map(image.grid, image.density)) {
    throw LoadError(begin + " for a label map, whose steps are no noise; leave it out");
  }
  const std::size_t levels = levels_of(image.density);
  if (levels >= kLeastLevels) return;
  throw LoadError(begin + " for a file of " + std::to_string(levels) +
                  " levels; noise can be distinguished from " + std::to_string(kLeastLevels) +
                  " on, leave it out");
}

/// Finds the noise of a volume, and makes the passes against it that the scene requests.
void denoise_volume(const VolumeSpec& spec, SceneVolume& volume) {
  VolumeImage& image = volume.image;
  if (spec.denoise > Denoise::off) refuse_steps(spec.denoise, image);
  if (!is_phantom(spec)) {  // which has none
    volume.noise = noise_of(image.grid, image.density, volume.iso);
  }
  volume.denoised = spec.denoise == Denoise::automatic ? passes_for(volume.noise)
                                                       : static_cast<int>(spec.denoise);
  if (volume.denoised == 0) return;
  // Labels may make softer voxels solid.
  image = spec.crop && image.labels.empty() ? crop_for_passes(image, volume.iso, volume.denoised)
                                            : enclosed_in_air(std::move(image), volume.iso);
  denoise(image.grid, image.density, volume.denoised);
}

/// Every unlabelled voxel beside a labelled one, along the axes, takes its label.
void grow_labels(const VoxelGrid& grid, std::vector<Label>& labels) {
  const std::vector<Label> before = labels;
  const std::array<std::int32_t, 3> extent{grid.nx, grid.ny, grid.nz};
  const std::array<std::ptrdiff_t, 3> stride{1, grid.nx, std::ptrdiff_t{grid.nx} * grid.ny};
  std::ptrdiff_t at = 0;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x, ++at) {
        Label& label = labels[static_cast<std::size_t>(at)];
        const std::array<std::int32_t, 3> location{x, y, z};
        for (std::size_t axis = 0; axis < 3 && label == 0; ++axis) {
          const auto beside = [&](std::ptrdiff_t step) {
            return before[static_cast<std::size_t>(at + step)];
          };
          if (location[axis] > 0) label = beside(-stride[axis]);
          if (label == 0 && location[axis] + 1 < extent[axis]) label = beside(stride[axis]);
        }
      }
    }
  }
}

/// Refuses a volume that reaches too far for the numbers of the servo.
void check_place(const VolumeSpec& spec, const SceneVolume& volume) {
  const WorldBox box = world_box(volume);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double reach_mm = std::max(-box.lo_mm[axis], box.hi_mm[axis]);
    if (reach_mm <= kLargestWorldMm) continue;  // not so for NaN
    refuse(spec.where, ": the volume reaches " + text_beside(reach_mm, kLargestWorldMm) +
                           " mm from the origin; keep it within " + number_text(kLargestWorldMm) +
                           ", check position_mm and spacing_mm");
  }
}

/// A volume as a recording has it, for what the scene's text says of it.
SceneVolume recorded_volume(const VolumeSpec& spec, SceneVolume volume, std::size_t materials) {
  volume.name = spec.name;
  volume.file = spec.file;
  volume.solid = spec.solid;
  if (spec.iso) volume.iso = nearest_density(*spec.iso * kDensityMax);
  const auto refuse_volume = [&](const std::string& why) {
    refuse(spec.where, ": the recorded volume " + why + "; copy the recording again");
  };
  if (volume.iso == 0) refuse_volume("has its surface at density 0");
  double square = 0;
  for (const double q : volume.pose.orientation) square += q * q;
  if (!(std::abs(square - 1) < 1e-9)) refuse_volume("has an orientation that is no rotation");
  try {
    check_labels(volume.image, materials + volume.proposed.size());
  } catch (const LoadError& error) {
    refuse_volume(error.what());
  }
  check_place(spec, volume);
  return volume;
}

}  // namespace

std::filesystem::path volume_path(const std::filesystem::path& folder, const std::string& file) {
  std::filesystem::path beside = folder / file;
  std::error_code fault;
  if (std::filesystem::exists(beside, fault)) return beside;
  const std::filesystem::path own = path_in_user_data(folder, file);
  return !own.empty() && std::filesystem::exists(own, fault) ? own : beside;
}

bool is_phantom(const VolumeSpec& volume) {
  return volume.file == kPhantomFile;
}

void scale_to_felt_iso(const std::vector<Material>& materials, Density iso, VolumeImage& image) {
  const auto own = [](const Material& material) { return material.felt_iso.has_value(); };
  if (image.labels.empty() || std::none_of(materials.begin(), materials.end(), own)) return;
  std::vector<double> scale;
  for (const Material& material : materials) {
    scale.push_back(material.felt_iso ? iso / (*material.felt_iso * kDensityMax) : 1.0);
  }
  std::vector<Label> labels = image.labels;
  for (int i = 0; i < kMaterialEdgeVoxels; ++i) grow_labels(image.grid, labels);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double density = image.density[i] * scale[labels[i]];
    image.density[i] = static_cast<Density>(std::lround(std::min(density, kDensityMax)));
  }
}

SceneVolume load_volume(const VolumeSpec& spec, const VolumeSource& from,
                        std::vector<Material> materials, std::optional<double> felt_at) {
  if (from.recorded != nullptr) {
    return recorded_volume(spec, std::move(*from.recorded), materials.size());
  }
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
  } catch (const LoadError& error) {
    refuse(spec.where, std::string(": ") + error.what());
  }
  volume.pose = place_volume(volume.image,
                             spec.orientation ? rotation_of(*spec.orientation) : kSourceStanding,
                             spec.position_mm);
  check_place(spec, volume);
  return volume;
}

}  // namespace kerf
