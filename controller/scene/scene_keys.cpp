// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_keys.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <tuple>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {
namespace {

/// One line for each type that a slot can have.
struct Get {
  std::span<const std::string_view> words;

  TomlValue operator()(const bool* from) const { return *from; }
  TomlValue operator()(const int* from) const { return std::int64_t{*from}; }
  TomlValue operator()(const double* from) const { return *from; }
  TomlValue operator()(const std::string* from) const {
    return from->empty() ? TomlValue{} : TomlValue{*from};
  }
  template <class Choice>
  TomlValue operator()(const Choice* from) const {
    return std::string(words[static_cast<std::size_t>(*from)]);
  }
  TomlValue operator()(const Denoise* from) const {
    if (*from > Denoise::off) return static_cast<std::int64_t>(*from);
    return std::string(words[*from == Denoise::off ? 1 : 0]);
  }
  TomlValue operator()(const VoxelGrid* from) const {
    return std::vector<double>{double(from->nx), double(from->ny), double(from->nz)};
  }
  /// All settings of the law, those that the scene leaves out too.
  TomlValue operator()(const LawChoice* from) const {
    if (from->name.empty()) return {};
    const LawRow& row = find_law(from->kind, from->name);
    const std::vector<double> values = law_values(row, *from);
    NamedNumbers law{from->name, {}};
    for (std::size_t i = 0; i < values.size(); ++i) {
      law.numbers.emplace_back(row.settings[i].name, values[i]);
    }
    return law;
  }
  template <std::size_t N>
  TomlValue operator()(const std::array<double, N>* from) const {
    return std::vector<double>(from->begin(), from->end());
  }
  template <class T>
  TomlValue operator()(const std::optional<T>* from) const {
    if (*from) return (*this)(&**from);
    return words.empty() ? TomlValue{} : TomlValue{std::string(words.front())};
  }
};

}  // namespace

std::size_t most_of(std::string_view table) {
  const auto row = std::ranges::find(scene_tables(), table, &SceneTableRow::name);
  return row == scene_tables().end() ? 0 : row->limit;
}

std::vector<std::string_view> names_below(std::string_view prefix, SceneKeys keys) {
  std::vector<std::string_view> names;
  for (const SceneKey& key : keys) {
    if (!key.name.starts_with(prefix)) continue;
    std::string_view name = key.name.substr(prefix.size());
    name = name.substr(0, name.find('.'));
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

std::vector<SceneKey> keys_of(std::string_view table, SceneKeys keys) {
  std::vector<SceneKey> rows;
  std::ranges::copy_if(keys, std::back_inserter(rows), [&](const SceneKey& key) {
    return key.name.substr(0, key.name.find('.')) == table;
  });
  return rows;
}

std::string_view name_in_table(const SceneKey& key) {
  return key.name.substr(key.name.find('.') + 1);
}

bool is_used(const SceneKey& key, SceneParts& parts) {
  const auto& [other, word, is, refusal] = key.only_with;
  if (other.empty()) return true;
  const auto row = std::ranges::find(scene_keys(), other, &SceneKey::name);
  return (value_of(*row, parts) == TomlValue{std::string(word)}) == is;
}

TomlValue value_of(const SceneKey& key, SceneParts& parts) {
  return std::visit(Get{key.allowed.words}, key.at(parts));
}

// The table. A new key is one row here, its member in scene.hpp, and its use; then
// `tests/docs/reference/make.py . build/release/bin write`.

namespace {

/// The part of a scene that has the member.
template <class Part, class T>
Part& part_with(T Part::*, SceneParts& parts) {
  SceneSpec& scene = parts.scene;
  return std::get<Part&>(std::tie(parts.volume, parts.tool, parts.tool.size, parts.tool.shaft,
                                  parts.tool.bur_settings, parts.material,
                                  static_cast<SceneSettings&>(scene), scene.device, scene.force,
                                  scene.cut, scene.spindle, scene.limits, scene.servo));
}

template <auto kMember>
SceneSlot at(SceneParts& parts) {
  return &(part_with(kMember, parts).*kMember);
}

using Words = std::span<const std::string_view>;

constexpr Allowed between(double lo, double hi, Words or_words = {}) {
  return {{lo, hi}, or_words};
}
constexpr Allowed one_of(Words words) {
  return {{}, words};
}

constexpr std::string_view kIsoWords[] = {"otsu"};
constexpr std::string_view kCutRateWords[] = {"1/T"};

constexpr SceneCondition kPaper{"force.model", "paper"};
constexpr SceneCondition kProxy{"force.model", "proxy"};
constexpr SceneCondition kExternal{"force.model", "external"};
constexpr SceneCondition kCoupled{
    "force.model", "paper", false,
    " is of a coupling, and force.model = \"paper\" has none; leave it "
    "out, or set model = \"proxy\""};
constexpr SceneCondition kPreston{"cut.model", "preston"};
constexpr SceneCondition kNoPreston{
    "cut.model", "preston", false,
    " is of the model overlap; leave it out, or set model = \"overlap\""};
constexpr SceneCondition kWater{"cut.pulp", "water"};
constexpr SceneCondition kSpindle{
    "cut.model", "preston", true,
    " turns nothing: only cut.model = \"preston\" has a spindle; leave it out"};
constexpr SceneCondition kOmni{"device.personality", "omni"};
constexpr SceneCondition kWooden{"device.personality", "woodenhaptics"};
constexpr SceneCondition kPhantom{"volume.file", kPhantomFile, true,
                                  " only shapes the phantom; leave it out, a file has its own"};
constexpr SceneCondition kNoPhantom{"volume.file", kPhantomFile, false,
                                    " is given with the phantom, which has its own; leave it out"};
constexpr SceneCondition kMesh{"tool.shape", kMeshShape};
constexpr SceneCondition kNoMesh{
    "tool.shape", kMeshShape, false,
    " is given with a mesh, which has its own size; leave it out, or set scale (mm per unit of the "
    "file)"};

// Ranges are wide enough for any tooth, bone and device, narrow enough that a slip of the unit
// shows. A row: key, unit, member, allowed values; meaning, condition, options.
// clang-format off
constexpr SceneKey kKeys[] = {
    {"scene.title", "", at<&SceneSettings::title>, {},
     "a short description, which readers of the segment get"},

    {"volume.name", "", at<&VolumeSpec::name>, {},
     "name of the volume in pictures and reports", {}, {.default_text = "the file's"}},
    {"volume.file", "", at<&VolumeSpec::file>, {},
     "NRRD, MetaImage, NIfTI, TIFF, InVesalius, or a folder of DICOM, PNG or TIFF slices, from the scene's folder; or \"phantom\"",
     {}, {.required_as = "file = \"phantom\" or a path"}},
    {"volume.shape", "", at<&VolumeSpec::shape>, one_of(kPhantomShapes),
     "what the phantom is: a tooth, one with caries, or a plain solid to measure on", kPhantom},
    {"volume.size", "voxels", at<&VolumeSpec::phantom_size>, between(16, 512),
     "samples of the phantom along x, y and z; its size in mm stays",
     kPhantom, {.default_text = "[256, 256, 161]"}},
    {"volume.spacing_mm", "mm", at<&VolumeSpec::spacing_mm>, between(1e-4, 100),
     "voxel edges along x, y and z, if the file has none; one number stands for all",
     kNoPhantom, {.default_text = "the file's", .one_for_all = true}},
    {"volume.override_spacing_mm", "mm", at<&VolumeSpec::override_spacing_mm>, between(1e-4, 100),
     "voxel edges that replace those of the file",
     kNoPhantom, {.default_text = "the file's", .one_for_all = true}},
    {"volume.window", "", at<&VolumeSpec::window>, between(-1e9, 1e9),
     "source values of density 0 and 1", kNoPhantom, {.default_text = "all of the file's values"}},
    {"volume.iso", "", at<&VolumeSpec::iso>, between(1e-4, 1, kIsoWords),
     "density (0 to 1) of the surface; otsu: the threshold of Otsu, 1979"},
    {"volume.denoise", "", at<&VolumeSpec::denoise>, between(1, kMostDenoise, kDenoiseWords),
     "passes of a filter against noise; auto: by the measured noise, 0 if there is none"},
    {"volume.crop", "", at<&VolumeSpec::crop>, {}, "cut away the air around it"},
    {"volume.solid", "", at<&VolumeSpec::solid>, {}, "the tool touches and cuts it; else it is only shown"},
    {"volume.pose.position_mm", "mm", at<&VolumeSpec::position_mm>,
     between(-kLargestWorldMm, kLargestWorldMm), "world position of the middle of its box"},
    {"volume.pose.orientation", "", at<&VolumeSpec::orientation>, between(-1.01, 1.01),
     "unit quaternion x, y, z, w that rotates the axes of the source to those of the world",
     {}, {.default_text = "the source's z is up"}},

    {"tool.name", "", at<&ToolSpec::name>, {},
     "name of the tool in pictures and reports",
     {}, {.default_text = "shape and size, or the file's"}},
    {"tool.bur", "", at<&ToolSpec::bur>, {},
     "a bur of ISO 6360 in place of shape, radius and shaft: its head (docs/scenes.md) and its diameter "
     "in tenths of a mm, such as \"001 014\"", {}, {.default_text = "none"}},
    {"tool.shape", "", at<&ToolSpec::shape>, one_of(kShapeWords),
     "a solid of revolution about y with its tip toward -y, or the mesh of a file",
     {}, {.required_as = "shape = \"ball\" or another, or bur = \"001 014\""}},
    {"tool.radius_mm", "mm", at<&ToolSize::radius_mm>, between(1e-4, 1000),
     "largest radius; either this or size_vox", kNoMesh, {.default_text = "none"}},
    {"tool.size_vox", "voxels", at<&ToolSize::size_vox>, between(1, 10000),
     "edge of the cube that the head fills, in pitches", kNoMesh},
    {"tool.length_mm", "mm", at<&ToolSize::length_mm>, between(1e-4, 1000),
     "height of the head; not for a ball, and not with size_vox",
     kNoMesh, {.default_text = "the shape's"}},
    {"tool.file", "", at<&ToolSpec::file>, {},
     "STL, from the scene's folder; the spindle turns it about its y axis",
     kMesh, {.required_as = "file = \"bur.stl\""}},
    {"tool.scale", "mm", at<&ToolSpec::scale>, between(1e-6, 1000), "length of a unit of the file", kMesh},
    {"tool.pitch_mm", "mm", at<&ToolSize::pitch_mm>, between(1e-4, 100),
     "distance of the samples",
     {}, {.default_text = "the smallest voxel edge, half of it for a radius below that"}},
    {"tool.shaft_radius_mm", "mm", at<&ShaftSize::radius_mm>, between(1e-4, 1000),
     "radius of the shaft behind the head; the shaft has contact and never cuts", {}, {.default_text = "none"}},
    {"tool.shaft_length_mm", "mm", at<&ShaftSize::length_mm>, between(1e-4, 1000),
     "length from the tool's tip to the end of the shaft", {}, {.default_text = "none"}},
    {"tool.handpiece_radius_mm", "mm", at<&ShaftSize::handpiece_radius_mm>, between(1e-4, 1000),
     "radius of the handpiece, which begins at the end of the shaft, has contact and never cuts",
     {}, {.default_text = "none"}},
    {"tool.handpiece_length_mm", "mm", at<&ShaftSize::handpiece_length_mm>, between(1e-4, 1000),
     "length of the handpiece", {}, {.default_text = "its radius"}},
    {"tool.grit", "", at<&BurSettings::grit>, one_of(kGritWords),
     "diamond grit, with its law of force, speed and wear (docs/cutting.md); none: Preston's law, no wear"},
    {"tool.force_exponent", "", at<&BurSettings::force_exponent>, between(0.1, 2),
     "power of the force above cut.threshold_n in the removal rate; at 1 N all powers give the same rate",
     {}, {.default_text = "the grit's: 1"}},
    {"tool.speed_exponent", "", at<&BurSettings::speed_exponent>, between(0, 2),
     "power of the spindle's speed in the removal rate; below 2,344/min at least 1",
     {}, {.default_text = "the grit's: 1, with a grit 0"}},
    {"tool.saturation_n", "N", at<&BurSettings::saturation_n>, between(0.1, 100),
     "force from which on the removal rate no longer grows; above cut.threshold_n",
     {}, {.default_text = "the grit's: medium 0.98, else none"}},
    {"tool.wear_half_n_s", "N s", at<&BurSettings::wear_half_n_s>, between(1, 1e9),
     "force times time of cutting after which the rate is half; after three times this value it is a quarter",
     {}, {.default_text = "the grit's: 110, 170, 260; else no wear"}},
    {"tool.turns", "", at<&ToolSpec::turns>, {}, "true: the tool rotates with the stylus; false: it keeps the axes of the world"},

    {"material.name", "", at<&Material::name>, {},
     "a material of the table (enamel, dentin, pulp) to change, or a new one, whose label is its position in the table",
     {}, {.required_as = "name = \"enamel\" or another"}},
    {"material.iso", "", at<&Material::iso>, between(0, 1),
     "density of the surface that is drawn", {}, {.default_text = "the material's, else 0.5"}},
    {"material.felt_iso", "", at<&Material::felt_iso>, between(1e-4, 1),
     "density of its surface in contact (docs/cutting.md)",
     {}, {.default_text = "volume.iso", .json = InJson::never}},
    {"material.machinability", "", at<&Material::machinability>, between(0, 1000),
     "removal rate relative to enamel", {}, {.default_text = "the material's, else 1"}},
    {"material.forbidden", "", at<&Material::forbidden>, {},
     "true: never cut by force; a force on it sets a flag", {}, {.json = InJson::if_changed}},
    {"material.colour", "", at<&Material::colour>, between(0, 1),
     "linear red, green and blue", {}, {.default_text = "the material's, else [0.9, 0.87, 0.8]"}},

    {"device.personality", "", at<&DeviceSettings::personality>, one_of(kPersonalityWords),
     "kind of the device"},
    {"device.workspace_scale", "", at<&DeviceSettings::workspace_scale>,
     between(kMinWorkspaceScale, kMaxWorkspaceScale), "mm of the scene per mm of the hand"},
    {"device.fit", "", at<&DeviceSettings::fit>, {},
     "true: the first volume fills the workspace, and workspace_scale has no effect; sizes in mm and cutting are for voxels of 0.125 mm, and grow with the voxels of the volume",
     {}, {.json = InJson::if_changed}},
    {"device.offset_mm", "mm", at<&DeviceSettings::offset_mm>,
     between(-kLargestWorldMm, kLargestWorldMm),
     "point of the scene at the origin of the device", {}, {.default_text = "the first surface below +y; with an external force [0, 0, 0]"}},
    {"device.torque_scale", "N mm", at<&DeviceSettings::torque_scale>,
     between(-kMaxTorqueScale, kMaxTorqueScale),
     "torque at each joint per motor count, at least 0.001, with the sign of the motor; for inverse3, touch and omega the true force along x, y, z over the commanded one: 1 (docs/first-hour.md)",
     {}, {.default_text = "the motors stay off"}},
    {"device.dock_rad", "rad", at<&DeviceSettings::dock_rad>, between(-3.15, 3.15),
     "joint angles in the inkwell", kOmni, {.json = InJson::always}},
    {"device.encoder_sign", "", at<&DeviceSettings::encoder_sign>, between(-1, 1),
     "1 or -1 for each joint: direction in which its encoder counts; it differs between the makers' branches (docs/devices.md)",
     kWooden, {.default_text = "[1, 1, 1]"}},
    {"device.first_tool", "", at<&DeviceSettings::first_tool>, {},
     "name of the tool at the start; a command changes it",
     {}, {.default_text = "the first; of a second device the second", .json = InJson::if_changed}},
    {"device.identified", "", at<&DeviceSettings::identified>, {},
     "a device.toml of kerf identify, from the scene's folder: mass, friction and delay for the checks of gains and for the emulator (docs/gains.md)",
     {}, {.default_text = "none", .json = InJson::never}},

    {"force.model", "", at<&ForceSettings::model>, one_of(kForceModelWords),
     "proxy: swept contact of the surface, coupled to the hand; paper: sum of gradients; external: a program gives the force, and the scene needs no volume and no tool (docs/own-law.md)"},
    {"force.p0_n_per_mm2", "N/mm^2", at<&ForceSettings::p0_n_per_mm2>, between(0, 1000),
     "force per mm^2 of surface", kPaper},
    {"force.stiffness_n_per_mm", "N/mm", at<&ForceSettings::stiffness_n_per_mm>,
     between(kMinStiffnessNPerMm, kMaxStiffnessNPerMm),
     "stiffness of the coupling, at the device (docs/gains.md has what is stable); external: highest stiffness that a goal of the program may have", kCoupled},
    {"force.damping_ns_per_mm", "N s/mm", at<&ForceSettings::damping_ns_per_mm>,
     between(0, kMaxDampingNsPerMm), "damping of the coupling, at the device; external: highest damping that a goal of the program may have", kCoupled},
    {"force.stale_ms", "ms", at<&ForceSettings::stale_ms>, between(1, 1000),
     "time for which a program's force counts without a new one, such as two or three of its periods; then it fades to zero in 15 ms", kExternal},
    {"force.unchecked_gain", "", at<&ForceSettings::unchecked_gain>, {},
     "true: gains are allowed that are unstable by the model of the device", kCoupled,
     {.json = InJson::if_changed}},
    {"force.friction", "", at<&ForceSettings::friction>, between(0, 1),
     "Coulomb coefficient of the tool on the surface", kProxy},

    {"force.law", "", at<&ForceSettings::law>, {},
     "a law in place of the coupling, by name or with its settings (docs/own-law.md); \"coupling\": no other law",
     kProxy, {.default_text = "the coupling of stiffness_n_per_mm and damping_ns_per_mm",
              .json = InJson::if_changed}},
    {"force.stabiliser", "", at<&ForceSettings::stabiliser>, {},
     "a law that may change the force after its limits, by name or with its settings (docs/own-law.md); \"none\": no such law",
     {}, {.default_text = "none", .json = InJson::if_changed}},

    {"cut.model", "", at<&CutSettings::model>, one_of(kCutModelWords),
     "preston: the force cuts; overlap: the covered material is removed at a rate; overlap_exact: the same at any rate of the servo",
     {}, {.default_text = "\"preston\"; with the paper's force \"overlap\", with an external one \"none\""}},
    {"cut.pedal", "", at<&CutSettings::pedal>, one_of(kCutPedalWords),
     "always: the tool always cuts; button: only while the device's first button is pressed; auto: button with --pedal, which a hand led by a window has, else always",
     {}, {.json = InJson::if_changed}},
    {"cut.rate_per_s", "1/s", at<&CutSettings::rate_per_s>, between(0, 100000, kCutRateWords),
     "fraction of the covered material that is removed; 1/T: all of it in each tick, as in the paper",
     kNoPreston},
    {"cut.p1_n_per_mm2", "N/mm^2", at<&CutSettings::p1_n_per_mm2>, between(0, 1000),
     "reaction per mm^2 of surface that is removed", kNoPreston},
    {"cut.machinability_mm3_per_s_n", "mm^3/(s N)", at<&CutSettings::machinability_mm3_per_s_n>,
     between(1e-4, 100), "removal rate of enamel, and of material without a label", kPreston},
    {"cut.threshold_n", "N", at<&CutSettings::threshold_n>, between(0, 3.3),
     "force up to which nothing is cut", kPreston},
    {"cut.friction", "", at<&CutSettings::friction>, between(0, 2),
     "tangential over normal force of the bur", kPreston},
    {"cut.pulp", "", at<&CutSettings::pulp>, one_of(kPulpMarkWords),
     "estimate of the temperature of the pulp, dry or with a spray of water; no force depends on it (docs/cutting.md)",
     kPreston, {.json = InJson::if_changed}},
    {"cut.water_c", "C", at<&CutSettings::water_c>, between(0, 60), "temperature of the spray", kWater},

    {"spindle.speed_krpm", "1000/min", at<&SpindleSettings::speed_krpm>, between(0, 500),
     "speed without load; 0: the spindle stands, and nothing is cut", kSpindle},
    {"spindle.stall_torque_n_mm", "N mm", at<&SpindleSettings::stall_torque_n_mm>,
     between(0.1, 1000), "torque at which the spindle stops", kSpindle},
    {"spindle.inertia_g_mm2", "g mm^2", at<&SpindleSettings::inertia_g_mm2>, between(0.01, 1000),
     "inertia of rotor and bur", kSpindle},

    {"limits.force_n", "N", at<&LimitSettings::force_n>, between(0.01, 12),
     "largest force at the device; at most the peak of the device, which is the default: 3.3 (inverse3 10, omega 12)",
     {}, {.default_text = "the device's: 3.3"}},
    {"limits.continuous_force_n", "N", at<&LimitSettings::continuous_force_n>, between(0.01, 12),
     "largest root mean square of the force over time; at most force_n; default of the device: 0.88 (inverse3 4, omega 12)",
     {}, {.default_text = "the device's: 0.88"}},
    {"limits.slew_n_per_ms", "N/ms", at<&LimitSettings::slew_n_per_ms>, between(0.22, 1.8),
     "change of force; a larger jump is a blow to the hand, a smaller one cannot follow the fade when "
     "reports are missing: force_n, at least 3.3 N, in 15 ms; of the device, and at most: 0.5 "
     "(inverse3 1.5, omega 1.8)",
     {}, {.default_text = "the device's: 0.5"}},
    {"limits.speed_mm_per_s", "mm/s", at<&LimitSettings::speed_mm_per_s>, between(1, 10000),
     "largest speed of the hand; a higher speed counts as a fault of the sensor"},

    {"servo.rate_hz", "Hz", at<&ServoSettings::rate_hz>, between(kMinRateHz, kMaxRateHz),
     "ticks per second"},
    {"servo.numeric", "", at<&ServoSettings::numeric>, one_of(kNumericWords),
     "number type of the loop; fixed: the same bits on every machine"},
    {"servo.kernel", "", at<&ServoSettings::kernel>, one_of(kGradientWords),
     "operator for the gradient of density"},
    {"servo.velocity", "", at<&ServoSettings::velocity>, {},
     "the estimator of the hand's velocity, by name or with its settings (docs/own-law.md)",
     {}, {.json = InJson::if_changed}},

    {"hand.script", "", at<&SceneSettings::hand_script>, {},
     "script of the emulated hand, from the scene's folder", {}, {.json = InJson::never}},
};
// clang-format on

constexpr SceneTableRow kTables[] = {
    {"scene", 0, "The scene as a whole."},
    {"volume", kMaxVolumes, "A solid to touch, to cut and to show."},
    {"tool", kMaxTools, "A tool that a hand can hold."},
    {"material", kMaxMaterials, "The material of a label."},
    {"device", 0,
     "The device, and its place in the scene. Two tables [[device]] are two arms, each with its "
     "tool, in the same volumes (docs/devices.md)."},
    {"force", 0, "The force of a contact."},
    {"cut", 0, "The removal of material (docs/cutting.md)."},
    {"spindle", 0, "The drive of the tool if force cuts: an air turbine."},
    {"limits", 0, "Limits of the force on the hand and of its speed."},
    {"servo", 0, "The servo loop."},
    {"hand", 0, "The hand of the emulator. Two tables [[hand]] are for two devices."},
};

}  // namespace

SceneKeys scene_keys() {
  return kKeys;
}

std::span<const SceneTableRow> scene_tables() {
  return kTables;
}

}  // namespace kerf
