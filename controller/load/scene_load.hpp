// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/sandbox/sandbox.hpp"
#include "controller/scene/scene_setting.hpp"

namespace kerf {

/// What the command line may change of a scene. Spacing and window belong to the first volume.
struct SceneOverrides {
  std::vector<SceneSetting> settings{};                 ///< --set table.key=VALUE
  std::optional<std::filesystem::path> volume_file{};   ///< --volume, "phantom" or a path
  std::optional<std::array<double, 3>> spacing_mm{};    ///< --spacing a[,b,c]
  std::optional<std::array<double, 2>> window{};        ///< --window lo,hi
  std::optional<int> rate_hz{};                         ///< --rate
  std::optional<NumericKind> numeric{};                 ///< --numeric
  std::optional<Personality> personality{};             ///< --device; torque_scale counts no more
  std::optional<std::array<double, 3>> torque_scale{};  ///< --torque-scale a,b,c
  std::optional<VoxelGrid> phantom_size{};              ///< every phantom, for tests and the lab
  bool unchecked_gain = false;                          ///< --unchecked-gain
  int read_cpu_s = kReadCpuSeconds;                     ///< --read-seconds, of each file
};

/// The tool of the default scene, at scale 1; `--volume` makes any other feel like it.
inline constexpr double kReferenceRadiusMm = 1.0;
/// The part of the device's workspace that a volume of `--volume` fills, x y z in mm.
inline constexpr std::array<double, 3> kWorkspaceMm = {100.0, 80.0, 60.0};

/// Reads the scene file and everything that it names, and checks it as a whole. Throws SceneError
/// with one line for the user. Load time only; takes a second or two for the default phantom.
///
/// Volumes are windowed to u16 (whole range of the source unless given), smoothed where the scene
/// or the noise that is found asks for it, cropped to what is solid plus three voxels of air, and
/// placed. The pitch of a tool is the smallest voxel edge of the solid volumes unless given. Where
/// the scene has no `offset_mm`, the device origin is put on the first surface below +y (see
/// `first_surface_from_above`) of the first solid volume.
///
/// With `volume_file` the first volume is replaced by that one, and the scene is fitted to it, so
/// that any CT can be felt with the hand scripts of the default scene:
/// - iso, window, materials and what is taken away as `propose_volume` has it, which a window of
/// the
///   options overrides; of a volume with labels, and of a map of labels alone, of which each
///   becomes a material: iso by Otsu, window from its range. Spacing from the file unless
///   overridden; denoise, pose and crop as in the scene;
/// - tools keep their size in voxels: lengths are scaled by the new over the old voxel edge (old:
///   the scene's spacing_mm, or that of the phantom);
/// - where it has labels, the materials' densities move with the surface: what begins at the
/// scene's
///   iso begins at the new one;
/// - spare tools (all but the first) that do not fit the volume are left out;
/// - workspace_scale s is such that its box, after cropping and in world axes, fits kWorkspaceMm;
///   the offset is found as above;
/// - p0 and p1 are multiplied by kReferenceRadiusMm / (s^2 R), R the radius of the active tool: the
///   stiffness felt at the device port becomes that of a ball of 1 mm at scale 1, as in the default
///   scene (K = s^2 2 pi R p0 = 0.377 N/mm with p0 = 0.06 N/mm^2). The proxy's stiffness is at the
///   device port as it stands;
/// - a tool g times as large takes g^3 as much at the same force of the hand: machinability is
///   multiplied by s g^3, the threshold by 1/s, the spindle's stall torque and inertia by g/s.
///
/// `device.fit` fits a scene to its own first volume in the same way; its sizes were written for
/// voxels of 0.125 mm. Where no volume has labels, only the materials that the scene names are
/// left.
[[nodiscard]] LoadedScene load_scene(const std::filesystem::path& path, const SceneOverrides& = {});

/// The same for what is not written yet: a scene whose text will lie at `path`, and the densities
/// and labels of its first volume, of which it says window = [0, 65535].
[[nodiscard]] LoadedScene load_scene(const std::filesystem::path& path, std::string_view text,
                                     VolumeImage first);

/// Stiffness in N/mm at the device port: of the coupling to the proxy; of the paper's force when
/// the active tool, taken as a ball of its radius, first touches a flat face: s^2 2 pi R p0.
[[nodiscard]] double device_stiffness_n_per_mm(const LoadedScene& scene);

/// Radius of the active tool at the device port over 1 mm. Hand scripts are written for a tool of
/// 1 mm at scale 1; multiplied by this they fit any scene.
[[nodiscard]] double hand_unit_mm(const LoadedScene& scene);

}  // namespace kerf
