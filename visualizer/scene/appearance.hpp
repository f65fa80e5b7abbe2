// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <glm/glm.hpp>

#include "visualizer/scene/camera_pose.hpp"
#include "visualizer/scene/gradient_plan.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// Cuts the volumes open, square to an axis of the world or to any direction: what lies beyond is
/// not drawn.
struct ClipPlane {
  static constexpr int kFree = 3;  ///< `axis` of any direction
  bool on = false;
  int axis = 2;                                  ///< 0 x, 1 y, 2 z: towards the first view
  double at = 0.5;                               ///< 0..1 of the way through the box of all volumes
  std::array<double, 3> towards{0.0, 0.0, 1.0};  ///< of kFree; length 1
  friend bool operator==(const ClipPlane&, const ClipPlane&) noexcept = default;
};

/// Two eyes side by side; lengths in mm.
struct Stereo {
  bool on = false;
  std::optional<double> eyes_mm{};         ///< none: `kEyesPerConvergence` of the next
  std::optional<double> convergence_mm{};  ///< none: as far as what the camera turns about
  friend bool operator==(const Stereo&, const Stereo&) noexcept = default;
};

/// The length over which the opacity of a material holds, so that a body looks the same in any
/// voxels: an edge of the voxels of the default scene.
inline constexpr double kOpacityMm = 0.125;

/// How deep light from outside goes: what the default look shows of it, 2.0 voxel edges of the
/// default scene below a surface and 0.2 of the border before it. By its gradient a lit layer is as
/// thick as `GradientPlan::surface_mm` and `TransferFunction::border_mm` say, which depend on the
/// voxels. So the translucent renderers weight the light with
///
///     (1 - 2^(-m kLitMm / c)) / (1 - 2^(-m (surface_mm + border_mm) / c)),
///
/// m the extinction per mm, c the cosine between ray and normal: what a ray sees of a lit layer as
/// thick as `kLitMm`, by what it sees of the one that is there. That one stays two edges thick: on
/// a surface whose radius is a few edges its normals turn within it.
inline constexpr double kLitMm = 0.2692;

/// Opacity over `kOpacityMm`, 0..1, by the name of the material.
using Opacities = std::map<std::string, double>;

/// How the volumes are shown: what a user may change while they are looked at.
struct ViewSettings {
  std::string renderer = "iso";  ///< of all volumes, or of each: renderer.hpp
  std::optional<double> iso{};   ///< of all volumes, 0..1 of full density; none: each its own
  Opacities opacities{};         ///< of the others: their own
  GradientFilter gradient = kDefaultGradient;
  ClipPlane clip{};
  Stereo stereo{};
  std::optional<CameraPose> camera{};  ///< at first, and of a reset; none: all volumes are framed
  bool voxel_tool = false;             ///< the tool is a volume, not a mesh
  bool colour_blind = false;  ///< materials in colours that any colour vision distinguishes
  friend bool operator==(const ViewSettings&, const ViewSettings&) noexcept = default;
};

inline constexpr int kPaletteWidth = 256;  ///< entries of a row

/// Linear colours in two rows: by density (entry i is density i/255; adjoining materials blend over
/// a narrow band, so that their border is smooth on a cut), then by label. Material 0 is "none" and
/// colours nothing; without others everything is ivory. The fourth component is the opacity of the
/// material over `kOpacityMm`, for the translucent renderers: its own, or else the softer, the more
/// opaque.
using Palette = std::array<std::array<glm::vec4, kPaletteWidth>, 2>;
[[nodiscard]] Palette make_palette(std::span<const MaterialView> materials);

/// The opacity that a material without one of its own has.
[[nodiscard]] double default_opacity(std::span<const MaterialView> materials, std::size_t index);

/// What a voxel looks like in the translucent renderers; plain data, the same for all of them.
///
/// A sample of density d has the colour of its material (by label if it has one, else by
/// density) and the opacity
///
///     1 - (1 - a)^(p * s / s0),   p = clamp((d - empty) / (full - empty), 0, 1)
///
/// over a length s, where a is the material's opacity over s0 = `kOpacityMm` (Beer and Lambert).
/// The exponent makes the picture independent of the step; p lets a border fade in, and material
/// that is milled away fade out.
///
/// A border is a ramp of density as wide as a voxel, so what p shows of it outside of the surface
/// (`border_mm`) grows with the voxels: with one ramp of p, a plate of 3 mm in voxels of 0.5 mm
/// would be 5 % more opaque than in those of 0.125. So in a volume without labels, whose surface is
/// where p is 1, the ramp of p is shorter by as much as the longest edge is longer than
/// `kOpacityMm`. With labels p begins below all surfaces, and each material's border remains as
/// wide as the voxels.
struct TransferFunction {
  /// Linear colour, and a as the fourth component: row 0 by density (entry i is density i/255), row
  /// 1 by label.
  Palette materials{};
  double empty = 0.0;      ///< density up to which nothing is seen
  double full = 1.0;       ///< density from which the material is seen whole
  double border_mm = 0.0;  ///< of the material, what the ramp shows outside of a surface

  /// p of a density.
  [[nodiscard]] double presence(double density) const noexcept;
  /// No voxel below this density is seen, though densities are rounded to 8 bits on the way.
  [[nodiscard]] Density lowest_seen() const noexcept;
};

/// The least opacity over `kOpacityMm` that counts as something: less makes no difference on a
/// screen. The first sample that reaches it gives the depth of a pixel.
inline constexpr double kLeastOpacity = 1.0 / 255.0;

/// Made from materials: the softer, the more opaque, so that dentin shows under enamel and pulp
/// in a cut. A volume with labels fades in up to its softest material; one without from `air` on,
/// up to `iso`, because air and noise have densities too. `longest_mm`: edge of a voxel.
[[nodiscard]] TransferFunction make_transfer_function(std::span<const MaterialView> materials,
                                                      Density iso, bool has_labels, Density air = 0,
                                                      double longest_mm = kOpacityMm);
/// That of one volume of a scene, whose air is what most of it has below the iso density.
[[nodiscard]] TransferFunction make_transfer_function(const SceneView& scene, std::size_t volume,
                                                      const VolumeContent& content);

/// The median of the densities below `iso`, rounded down to 8 bits; 0 if there are none. A CT
/// has its own value for air, far above the lowest one, as the paper's tooth: 0.3 of the highest.
[[nodiscard]] Density air_level(std::span<const Density> density, Density iso);

/// The transfer function as a user keeps it, in TOML:
///
///     [opacity]      # over 1/8 mm, 0..1, by material; those left out keep their own
///     enamel = 0.1
///
/// Every mistake is a VisualizerError of one line: `name`, line, value, way out.
[[nodiscard]] Opacities parse_transfer(std::string_view text, const std::string& name);
[[nodiscard]] Opacities read_transfer(const std::filesystem::path& file);

/// Writes the opacities of all materials, whole or not at all. Throws FileError.
void write_transfer(const std::filesystem::path& file, const Opacities& opacities);

/// Throws VisualizerError for a material that the scene does not have.
void check_materials(const Opacities& opacities, const SceneView& scene, const std::string& name);

}  // namespace kerf
