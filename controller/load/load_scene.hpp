// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/input/sandbox.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene_file.hpp"

// A scene and all its files to a `LoadedScene`.

namespace kerf {

/// Settings of a scene that the command line may replace. Spacing and window belong to the first
/// volume.
struct SceneOverrides {
  std::vector<KeyOverride> settings{};                         ///< --set table.key=VALUE
  std::optional<std::filesystem::path> volume_file{};          ///< --volume, "phantom" or a path
  std::optional<std::array<double, 3>> spacing_mm{};           ///< --spacing a[,b,c]
  std::optional<std::array<double, 3>> override_spacing_mm{};  ///< --override-spacing a[,b,c]
  std::optional<std::array<double, 2>> window{};               ///< --window lo,hi
  std::optional<int> rate_hz{};                                ///< --rate
  std::optional<NumericKind> numeric{};                        ///< --numeric
  std::optional<Personality> personality{};                    ///< --device; cancels torque_scale
  std::optional<std::array<double, 3>> torque_scale{};         ///< --torque-scale a,b,c
  std::optional<std::array<double, 3>> second_torque_scale{};  ///< --torque-scale a,b,c,d,e,f
  std::optional<VoxelGrid> phantom_size{};  ///< every phantom, for tests and the lab
  bool unchecked_gain = false;              ///< --unchecked-gain
  bool pedal = false;                       ///< --pedal: `auto` of cut.pedal is `button`
  int read_cpu_s = kReadCpuSeconds;         ///< --read-seconds, of each file
};

/// The tool of the default scene, at scale 1; `--volume` scales it for any other volume.
inline constexpr double kReferenceRadiusMm = 1.0;
/// The part of the device's workspace that a volume of `--volume` fills, x y z in mm.
inline constexpr std::array<double, 3> kWorkspaceMm = {100.0, 80.0, 60.0};

/// Reads the scene file and all files that it names, and checks it as a whole. Throws LoadError
/// with one line for the user. Load time only; takes a second or two for the default phantom.
///
/// Volumes are windowed to u16 (whole range of the source unless given), smoothed if the scene or
/// the measured noise requires it, cropped to the solid voxels plus three voxels of air, and
/// placed. The pitch of a tool is the smallest voxel edge of the solid volumes unless given. If the
/// scene has no `offset_mm`, the device origin is moved to the first surface below +y (see
/// `first_surface_from_above`) of the first solid volume.
///
/// With `volume_file` the first volume is replaced by that one, and the scene is fitted to it, so
/// that any CT can be touched with the hand scripts of the default scene:
/// - iso, window, materials and removed parts by `propose_volume`; a window of the options
///   replaces the proposed one. For a volume with labels, and for a map of labels alone, of which
///   each becomes a material: iso by Otsu, window from its range. Spacing from the file unless
///   overridden; denoise, pose and crop as in the scene;
/// - tools keep their size in voxels: lengths are scaled by the new over the old voxel edge (old:
///   the scene's spacing_mm, or that of the phantom);
/// - if it has labels, the materials' densities move with the surface, from the scene's iso to
///   the new one;
/// - spare tools (all but the first) that do not fit the volume are left out;
/// - workspace_scale s is such that its box, after cropping and in world axes, fits kWorkspaceMm;
///   the offset is found as above;
/// - p0 and p1 are multiplied by kReferenceRadiusMm / (s^2 R), R the radius of the active tool: the
///   stiffness at the device port becomes that of a ball of 1 mm at scale 1, as in the default
///   scene (K = s^2 2 pi R p0 = 0.377 N/mm with p0 = 0.06 N/mm^2). The proxy's stiffness is given
///   at the device port and stays;
/// - a tool g times as large removes g^3 as much at the same force of the hand: machinability is
///   multiplied by s g^3, the threshold and the forces of a bur's law by 1/s, the spindle's stall
///   torque and inertia by g/s.
///
/// `device.fit` fits a scene to its own first volume in the same way; its sizes were written for
/// voxels of 0.125 mm. If no volume has labels, only the materials that the scene names stay.
[[nodiscard]] LoadedScene load_scene(const std::filesystem::path& path, const SceneOverrides& = {});

/// What a recording has of a loaded scene. Takes the place of its files, and is checked as they
/// are.
struct RecordedInputs {
  /// By number; none: of its file. Name, file, `solid` and a given iso are those of the scene's
  /// text.
  std::vector<std::optional<SceneVolume>> volumes{};
  std::vector<std::pair<std::string, ToolMesh>> meshes{};  ///< by the name of the tool
  /// No `device.identified` is read: a recording has its ticks, and the file may be gone.
  bool without_device_file = false;
};

/// Loads a scene from `text`, which the file at `path` has, or had.
[[nodiscard]] LoadedScene load_scene(const std::filesystem::path& path, std::string_view text,
                                     const SceneOverrides& overrides, RecordedInputs recorded = {});

/// Loads a scene before its files are written: a scene whose text will be written to `path`, and
/// the densities and labels of its first volume, whose window there is [0, 65535].
[[nodiscard]] LoadedScene load_scene(const std::filesystem::path& path, std::string_view text,
                                     VolumeImage first, const SceneOverrides& overrides = {});

/// Stiffness in N/mm at the device port: of the coupling to the proxy; of the paper's force when
/// the active tool, taken as a ball of its radius, first touches a flat face: s^2 2 pi R p0.
[[nodiscard]] double device_stiffness_n_per_mm(const LoadedScene& scene);

/// Radius of the active tool at the device port over 1 mm. Hand scripts are written for a tool of
/// 1 mm at scale 1; multiplied by this they fit any scene.
[[nodiscard]] double hand_unit_mm(const LoadedScene& scene);

// The parts of loading: one volume (load_volume.cpp), and one tool.

/// Whether a volume is the phantom, which has no file.
[[nodiscard]] bool is_phantom(const VolumeSpec& volume);

/// Path of a volume's file, which a scene in `folder` names. For a scene that comes with kerf,
/// whose folder may belong to root, it may lie at the same path below the user's data folder.
[[nodiscard]] std::filesystem::path volume_path(const std::filesystem::path& folder,
                                                const std::string& file);

/// Source of one volume.
struct VolumeSource {
  std::filesystem::path folder;
  bool unknown = false;  ///< the scene has no settings for it
  int cpu_s = 0;
  VolumeImage* image = nullptr;     ///< if set, replaces the file
  SceneVolume* recorded = nullptr;  ///< if set, replaces file and reading: RecordedInputs
};

/// One volume after loading; the scene has these `materials`. `felt_at`: the iso for which their
/// `felt_iso` was written; if empty, that of the volume. Throws LoadError. Load time.
[[nodiscard]] SceneVolume load_volume(const VolumeSpec& spec, const VolumeSource& from,
                                      std::vector<Material> materials,
                                      std::optional<double> felt_at);

/// An unlabelled voxel this near to a labelled one is the edge of its material.
inline constexpr int kMaterialEdgeVoxels = 3;

/// Gives each material the surface that its `felt_iso` names: the densities of its voxels are
/// scaled so that `felt_iso` becomes `iso`, the surface at which the whole volume is touched,
/// drawn and cropped; higher ones are clamped to full density. A soft body then touches, and is
/// cut, as a hard one of the same shape, and a wall between two of them has no gap. Its unlabelled
/// edge is scaled along (docs/theory.md 2.1).
///
/// The map is not kept: from here on these are the densities of the volume, so a cut needs no map.
/// Materials without `felt_iso` keep theirs, and so does an image without labels. Load time.
void scale_to_felt_iso(const std::vector<Material>& materials, Density iso, VolumeImage& image);

/// Extent of the solid volumes, which limits the sizes of tools.
struct SolidExtent {
  double voxel_mm = std::numeric_limits<double>::infinity();  ///< smallest edge
  double side_mm = 0;                                         ///< longest side of a box
};
[[nodiscard]] SolidExtent touched_volumes(const std::vector<SceneVolume>& volumes);

/// Source of the mesh of a tool.
struct MeshSource {
  std::filesystem::path folder;
  int cpu_s = kReadCpuSeconds;
  const ToolMesh* mesh = nullptr;  ///< if set, replaces the file; in mm
};

/// The samples of one tool, or those of its mesh. Throws LoadError if it does not fit the volumes.
/// Load time.
[[nodiscard]] SceneTool load_tool(const ToolSpec& spec, const SolidExtent& touched,
                                  const MeshSource& from);

}  // namespace kerf
