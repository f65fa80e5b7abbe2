// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "shared/wire/personality.hpp"

// A scene file as values: its checked settings, and the defaults of all others. No array is read
// yet (controller/load). Limits and words first, then one struct per table of the file.

namespace kerf {

/// The shapes of the phantom, in a box of 32 x 32 x 20 mm, z up:
///
///   molar          a lower molar of enamel, dentin and pulp
///   carious_molar  the same with a lesion below its fissures: a fourth label
///   wall           solid in the lower half of the box
///   ball           of 8 mm radius
///   torus          about z, ring of 10 mm, tube of 4 mm
///
/// The last three have no labels, and their surface at a density of 0.5.
inline constexpr std::string_view kMolar = "molar";
inline constexpr std::string_view kCariousMolar = "carious_molar";
inline constexpr std::array<std::string_view, 5> kPhantomShapes = {kMolar, kCariousMolar, "wall",
                                                                   "ball", "torus"};

/// The shapes that a [[tool]] can have, its tip (the lowest point of the head) toward -y and the
/// shaft toward +y. All but the mesh are solids of revolution about the y axis:
///
///   ball           a sphere
///   cylinder       flat at both ends
///   cone           pointed at the tip, widest at the shaft
///   inverted_cone  widest at the tip, 0.6 of that at the shaft
///   flame          a pointed ogive up to 0.6 of the length, then drawn in to half at the shaft
///   pear           rounded at the tip, widest soon above it, 0.65 of that at the shaft
///   wheel          a flat disc whose rim is half of a torus as thick as the disc
///   stl            the mesh of a file
inline constexpr std::string_view kMeshShape = "stl";
inline constexpr std::array<std::string_view, 8> kShapeWords = {
    "ball", "cylinder", "cone", "inverted_cone", "flame", "wheel", "pear", kMeshShape};
inline constexpr auto kToolShapes = std::span(kShapeWords).first<7>();  ///< of revolution

/// Size of one tool in the scene; all in mm unless counted in pitches.
struct ToolSize {
  double pitch_mm = 0.125;                 ///< distance of the samples
  double radius_mm = 1.0;                  ///< largest radius; used when `size_vox` is empty
  std::optional<double> length_mm{};       ///< height of the head; not for a ball
  std::optional<std::int32_t> size_vox{};  ///< the head fills a cube of so many pitches
};

/// Shaft and handpiece of the scene: they make contact and never cut. Cylinders about the tool's
/// axis; a handpiece begins at the end of the shaft.
struct ShaftSize {
  std::optional<double> radius_mm{};  ///< if empty, there is no shaft
  std::optional<double> length_mm{};  ///< from the tool's tip to the shaft's end, head included
  std::optional<double> handpiece_radius_mm{};  ///< if empty, there is none
  std::optional<double> handpiece_length_mm{};  ///< if empty, its radius
};

inline constexpr double kMinWorkspaceScale = 0.01, kMaxWorkspaceScale = 100;
inline constexpr double kLargestWorldMm = 10000;  ///< a third of the range of the loop's numbers
inline constexpr double kMinTorqueScale = 1e-3;   // N mm per count
inline constexpr double kMaxTorqueScale = 10;
inline constexpr int kMinRateHz = 250;            // slower than the hand can be held stable
inline constexpr int kMaxRateHz = 8000;           // one tick per cycle of the FireWire bus
inline constexpr std::size_t kMaxMaterials = 32;  // labels are small indices

// Gains that all number types of the loop hold with room to spare: in fixed point a stiffness ends
// at 128 N/mm, a damping at 2 N s/mm. The limits of a device are those of its port.
inline constexpr double kMinStiffnessNPerMm = 0.001;
inline constexpr double kMaxStiffnessNPerMm = 100;
inline constexpr double kMaxDampingNsPerMm = 1;

/// The `file` of a [[volume]] that is computed instead of read.
inline constexpr std::string_view kPhantomFile = "phantom";

/// Removal rate of enamel per newton at the reference speed, mm^3/(s N): 0.067 to 0.108 of human
/// enamel under a diamond bur at 50 to 80 g (docs/forces.md 6.6).
inline constexpr double kEnamelMm3PerSN = 0.083;
inline constexpr double kReferenceSpeedKrpm = 300;

/// A [[material]]; its index in the list is the label of its voxels.
struct Material {
  std::string name;
  bool in_scene = false;             ///< the scene's text names it
  double iso = 0.5;                  ///< density, 0..1
  std::optional<double> felt_iso{};  ///< density of its surface; if empty, the volume's iso
  double machinability = 1.0;        ///< removal rate over that of enamel
  bool forbidden = false;            ///< never cut by force; a press on it is reported
  std::array<double, 3> colour{0.9, 0.87, 0.8};  ///< linear RGB, 0..1
};

/// The numbers of the loop.
enum class NumericKind : std::uint8_t { fixed, float64 };
enum class ForceModel : std::uint8_t {
  paper,    ///< sum of gradients over the samples of the tool
  proxy,    ///< swept contact of the tool surface, coupled to the hand
  external  ///< a program gives the force, and nothing of the volumes is felt
};
/// How material leaves (docs/cutting.md).
enum class CutModel : std::uint8_t { none, overlap, overlap_exact, preston };
/// When the tool cuts.
enum class CutPedal : std::uint8_t {
  automatic,  ///< `button` with `--pedal`, else `always`
  always,
  button  ///< while the device's first button is pressed
};

/// Diamond grit of a bur. It chooses the law by which the bur cuts (docs/cutting.md).
enum class Grit : std::uint8_t { none, medium, coarse, super_coarse };

/// How press and speed of a bur become removal, beside the machinability of what it cuts
/// (docs/forces.md 6.1). As it is here: Preston's law.
struct BurLaw {
  double force_exponent = 1;  ///< a
  double speed_exponent = 1;  ///< b
  double saturation_n = 0;    ///< a higher press removes no more; 0: there is no such press
  double wear_half_n_s = 0;   ///< press times time after which the rate has halved; 0: no wear

  friend bool operator==(const BurLaw&, const BurLaw&) = default;
};

/// The law of a [[tool]] as written; what is empty is that of the grit.
struct BurSettings {
  Grit grit = Grit::none;
  std::optional<double> force_exponent, speed_exponent, saturation_n, wear_half_n_s;
};

/// Whether the temperature of the pulp is a mark, and how the tooth is prepared (docs/cutting.md).
enum class PulpMark : std::uint8_t { off, dry, water };

/// The filter against a volume's noise: a word, or how many passes of it.
enum class Denoise : std::int8_t { automatic = -1, off = 0 };
inline constexpr std::array<std::string_view, 2> kDenoiseWords = {"auto", "off"};
inline constexpr int kMostDenoise =
    3;  ///< passes; more would move a scan's edges (docs/theory.md 2.4)

// The tables of a scene file. Meaning, unit and range of a member: scene_keys.cpp.

/// [device]
struct DeviceSettings {
  Personality personality{};
  double workspace_scale = 1.0;  ///< x_scene = scale * x_device
  bool fit = false;              ///< the scale follows from the first volume
  std::array<double, 3> offset_mm{0, 0, 0};
  std::optional<std::array<double, 3>> torque_scale;  ///< if empty, the motors stay off
  std::array<double, 3> dock_rad{0.0, 0.23, -0.37};
  std::optional<std::array<double, 3>> encoder_sign;  ///< 1 or -1 each; if empty, 1
  /// In the hand at the start; if empty, the first tool, and of a second device the second.
  std::string first_tool;
  std::string tool_location;  ///< begins a complaint about it
  /// A file of `kerf identify`, whose values stand in for those of the personality; relative to the
  /// working directory, may be empty.
  std::string identified;
};

/// [force]
struct ForceSettings {
  ForceModel model = ForceModel::proxy;
  double p0_n_per_mm2 = 0.06;
  double stiffness_n_per_mm = 0.4;
  double damping_ns_per_mm = 0.002;
  double stale_ms = 20;  ///< of a force of a program
  double friction = 0.0;
  LawChoice law{LawKind::force, "", {}};              ///< if without a name, the coupling
  LawChoice stabiliser{LawKind::stabiliser, "", {}};  ///< if without a name, none
  bool unchecked_gain = false;  ///< accept a loop that the model of its device calls unstable
};

/// [cut]
struct CutSettings {
  CutModel model = CutModel::preston;
  CutPedal pedal = CutPedal::automatic;
  double rate_per_s = 20.0;  ///< k; 1/T is the paper's own step
  double p1_n_per_mm2 = 0.06;
  // If the model is preston:
  double machinability_mm3_per_s_n = kEnamelMm3PerSN;
  double threshold_n = 0.05;
  double friction = 0.5;
  /// Press at which a bur removes as much as by Preston's law, whatever its exponent: 1 N at the
  /// device once `fit` has changed the scene's forces.
  double reference_n = 1;
  PulpMark pulp = PulpMark::off;
  double water_c = 23;  ///< of the spray: a surgery's room temperature
};

/// [spindle]: turns the tool in the model preston; an air turbine.
struct SpindleSettings {
  double speed_krpm = kReferenceSpeedKrpm;
  double stall_torque_n_mm = 3.0;  ///< tuned: a turbine loses a tenth of its speed in a deep cut
  double inertia_g_mm2 = 4.5;
};

/// [limits]
struct LimitSettings {
  double force_n = 3.3;
  double continuous_force_n = 0.88;
  double slew_n_per_ms = 0.5;
  double speed_mm_per_s = 10000.0;
};

/// [servo]
struct ServoSettings {
  int rate_hz = 1000;
  NumericKind numeric = NumericKind::fixed;
  GradientKernel kernel = GradientKernel::farid;
  LawChoice velocity{LawKind::velocity, "foaw", {}};
};

/// The second [[device]] and [[hand]]: an arm of its own, with the scale of the first.
struct SecondArm {
  DeviceSettings device;
  bool offset_given = false;  ///< else it has the first one's
  LimitSettings limits;       ///< the scene's, and its device's where the scene has none
  std::string hand_script, hand_location;
};

/// All settings of a scene but volumes and tools; the same before and after loading.
struct SceneSettings {
  std::string path;
  std::string title;  ///< [scene] title; may be empty
  std::vector<Material> materials;
  DeviceSettings device;
  ForceSettings force;
  CutSettings cut;
  SpindleSettings spindle;
  LimitSettings limits;
  ServoSettings servo;
  std::optional<SecondArm> second;
  std::string hand_script;    ///< [hand] script, relative to the working directory; may be empty
  std::string hand_location;  ///< begins a complaint about it
};

/// One [[volume]] as written; `where` begins a complaint about its content.
struct VolumeSpec {
  std::string where;  ///< `file:line`
  std::string name;
  std::string file;                                 ///< as written
  std::string shape{kMolar};                        ///< one of kPhantomShapes, with the phantom
  std::optional<VoxelGrid> phantom_size;            ///< only with file = "phantom"
  std::optional<std::array<double, 3>> spacing_mm;  ///< along axes of which the file has none
  std::optional<std::array<double, 3>> override_spacing_mm;  ///< in place of the file's
  std::optional<std::array<double, 2>> window;               ///< source values of density 0 and 1
  std::optional<double> iso;  ///< density 0..1; if empty, Otsu's threshold
  Denoise denoise = Denoise::automatic;
  bool crop = true;
  bool solid = true;
  std::array<double, 3> position_mm{0, 0, 0};  ///< world position of the middle of its box
  std::optional<std::array<double, 4>>
      orientation;  ///< world from source; if empty, the z axis is up
};

/// One [[tool]] as written; the `..._location` members begin complaints about size and pitch.
struct ToolSpec {
  std::string where;  ///< `file:line`, of a mesh
  std::string size_location, pitch_location;
  std::string name;
  std::string bur;  ///< as written; its expansion is in the other members
  std::string shape;
  std::string file;          ///< of a mesh, as written
  double scale = 1;          ///< mm per unit of the mesh
  bool pitch_given = false;  ///< else the smallest voxel of the solid volumes
  ToolSize size;
  ShaftSize shaft;
  std::string shaft_location;  ///< begins complaints about the shaft
  BurSettings bur_settings;
  BurLaw law;  ///< that of the settings
  std::string
      law_location;  ///< of a setting of the law, to complain about it; empty: there is none
  bool turns = true;
};

/// `file:line: key = value` of limits; empty: the scene leaves it to the device.
struct LimitPlaces {
  std::string force, continuous, slew;
};

/// A scene file after parsing: every value is checked, no other file is read, no array is made.
struct SceneSpec : SceneSettings {
  std::vector<VolumeSpec> volumes;
  std::vector<ToolSpec> tools;
  bool offset_given = false;     ///< else the device origin is moved to the first surface
  bool cut_in_one_tick = false;  ///< rate_per_s = "1/T", the paper's own step
  LimitPlaces limit_places;
};

// The words of a scene for the values of an enumeration, in its order: one list for reading a scene
// and for writing its JSON.
inline constexpr std::array<std::string_view, 3> kForceModelWords = {"paper", "proxy", "external"};
inline constexpr std::array<std::string_view, 4> kCutModelWords = {"none", "overlap",
                                                                   "overlap_exact", "preston"};
inline constexpr std::array<std::string_view, 3> kCutPedalWords = {"auto", "always", "button"};
inline constexpr std::array<std::string_view, 3> kPulpMarkWords = {"off", "dry", "water"};
inline constexpr std::array<std::string_view, 4> kGritWords = {"none", "medium", "coarse",
                                                               "super-coarse"};
inline constexpr std::array<std::string_view, 2> kNumericWords = {"fixed", "double"};
inline constexpr std::array<std::string_view, 3> kGradientWords = {"central", "sobel5", "farid"};

[[nodiscard]] constexpr std::string_view word_of(ForceModel model) {
  return kForceModelWords.at(static_cast<std::size_t>(model));
}
[[nodiscard]] constexpr std::string_view word_of(CutModel model) {
  return kCutModelWords.at(static_cast<std::size_t>(model));
}
[[nodiscard]] constexpr std::string_view word_of(CutPedal pedal) {
  return kCutPedalWords.at(static_cast<std::size_t>(pedal));
}
[[nodiscard]] constexpr std::string_view word_of(NumericKind numeric) {
  return kNumericWords.at(static_cast<std::size_t>(numeric));
}
[[nodiscard]] constexpr std::string_view word_of(GradientKernel kernel) {
  return kGradientWords.at(static_cast<std::size_t>(kernel));
}

}  // namespace kerf
