// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <span>
#include <utility>

#include "controller/scene/materials.hpp"
#include "controller/scene/scene_objects.hpp"
#include "controller/scene/scene_table.hpp"
#include "controller/scene/scene_text.hpp"
#include "controller/scene/scene_words.hpp"
#include "controller/servo/servo_limits.hpp"

namespace kerf {
namespace {

using Keys = std::string_view[];
using KeyList = std::span<const std::string_view>;

// Ranges are wide enough for any tooth, bone and device, narrow enough that a slip of the unit
// shows.
constexpr Range kWorldMm{-kLargestWorldMm, kLargestWorldMm};
constexpr Range kWorkspaceScale{kMinWorkspaceScale, kMaxWorkspaceScale};
constexpr Range kTorqueScale{-kMaxTorqueScale,
                             kMaxTorqueScale};  // N mm per count; the sign is the motor's
constexpr Range kAngleRad{-3.15, 3.15};
constexpr Range kPressureNPerMm2{0, 1000};
// Beyond, an Omni trembles in the hand (what other haptics packages allow it).
constexpr Range kStiffnessNPerMm{0.01, 0.7};
constexpr Range kDampingNsPerMm{0, 0.005};
constexpr Range kProxyFriction{0, 1};
constexpr Range kCutRatePerS{0, 100000};
constexpr Range kMachinabilityMm3PerSN{1e-4, 100};
constexpr Range kThresholdN{0, 3.3};
constexpr Range kFriction{0, 2};
constexpr Range kSpeedKrpm{0, 500};  // 0: it stands, and nothing is cut
constexpr Range kStallTorqueNMm{0.1, 1000};
constexpr Range kInertiaGMm2{0.01, 1000};
constexpr Range kForceN{0.01, 3.3};       // what the Omni can give
constexpr Range kSlewNPerMs{0.001, 0.5};  // a jump that the hand does not take for a blow
constexpr Range kSpeedMmPerS{1, 10000};   // faster is a fault of the sensor
constexpr Range kRateHz{kMinRateHz, kMaxRateHz};

constexpr Keys kRootKeys = {"volume", "tool",  "device", "force",    "cut",
                            "limits", "servo", "hand",   "material", "spindle"};
constexpr Keys kDeviceKeys = {"personality", "workspace_scale", "offset_mm", "torque_scale",
                              "dock_rad"};
constexpr Keys kForceKeys = {"model", "p0_n_per_mm2", "stiffness_n_per_mm", "damping_ns_per_mm",
                             "friction"};
constexpr Keys kCutKeys = {"model",       "rate_per_s", "p1_n_per_mm2", "machinability_mm3_per_s_n",
                           "threshold_n", "friction"};
constexpr Keys kSpindleKeys = {"speed_krpm", "stall_torque_n_mm", "inertia_g_mm2"};
constexpr Keys kLimitKeys = {"force_n", "continuous_force_n", "slew_n_per_ms", "speed_mm_per_s"};
constexpr Keys kServoKeys = {"rate_hz", "numeric", "kernel"};
constexpr Keys kHandKeys = {"script"};

constexpr Keys kCutRateWords = {"1/T"};

template <class Enum>
void read_choice(const SceneTable& table, std::string_view key,
                 std::span<const std::string_view> words, Enum& into) {
  if (const auto index = table.choice(key, words)) into = static_cast<Enum>(*index);
}

void read_device_table(const SceneTable& table, Scene& scene) {
  DeviceSettings& device = scene.device;
  read_choice(table, "personality", kPersonalityWords, device.personality);
  device.workspace_scale =
      table.number("workspace_scale", kWorkspaceScale).value_or(device.workspace_scale);
  scene.offset_given = table.has("offset_mm");
  device.offset_mm = table.numbers<3>("offset_mm", kWorldMm).value_or(device.offset_mm);
  device.torque_scale = table.numbers<3>("torque_scale", kTorqueScale);
  if (device.torque_scale) {
    for (const double scale : *device.torque_scale) {
      if (std::abs(scale) < kMinTorqueScale) {
        refuse(table.place("torque_scale"),
               " is below 0.001 N mm per count; leave the key out to keep the motors off");
      }
    }
  }
  if (table.has("dock_rad") && device.personality != Personality::omni) {
    refuse(table.place("dock_rad"), " is of the Omni's inkwell; leave it out for this device");
  }
  device.dock_rad = table.numbers<3>("dock_rad", kAngleRad).value_or(device.dock_rad);
}

/// A key that its model would ignore is a misunderstanding.
void refuse_ignored(const SceneTable& table, KeyList keys, const std::string& of_model) {
  for (const std::string_view key : keys) {
    if (table.has(key)) {
      refuse(table.place(key), " is of the model " + of_model +
                                   "; leave it out, or set model = \"" + of_model + "\"");
    }
  }
}

void read_force_table(const SceneTable& table, ForceSettings& force) {
  constexpr Keys kPaperKeys = {"p0_n_per_mm2"};
  constexpr Keys kProxyKeys = {"stiffness_n_per_mm", "damping_ns_per_mm", "friction"};
  read_choice(table, "model", kForceModelWords, force.model);
  const bool proxy = force.model == ForceModel::proxy;
  refuse_ignored(table, proxy ? KeyList(kPaperKeys) : KeyList(kProxyKeys),
                 proxy ? "paper" : "proxy");
  force.p0_n_per_mm2 = table.number("p0_n_per_mm2", kPressureNPerMm2).value_or(force.p0_n_per_mm2);
  force.stiffness_n_per_mm =
      table.number("stiffness_n_per_mm", kStiffnessNPerMm).value_or(force.stiffness_n_per_mm);
  force.damping_ns_per_mm =
      table.number("damping_ns_per_mm", kDampingNsPerMm).value_or(force.damping_ns_per_mm);
  force.friction = table.number("friction", kProxyFriction).value_or(force.friction);
}

void read_cut_table(const SceneTable& table, Scene& scene) {
  read_choice(table, "model", kCutModelWords, scene.cut.model);
  constexpr Keys kOverlapKeys = {"rate_per_s", "p1_n_per_mm2"};
  constexpr Keys kPrestonKeys = {"machinability_mm3_per_s_n", "threshold_n", "friction"};
  const bool preston = scene.cut.model == CutModel::preston;
  refuse_ignored(table, preston ? KeyList(kOverlapKeys) : KeyList(kPrestonKeys),
                 preston ? "overlap" : "preston");
  CutSettings& cut = scene.cut;
  cut.machinability_mm3_per_s_n = table.number("machinability_mm3_per_s_n", kMachinabilityMm3PerSN)
                                      .value_or(cut.machinability_mm3_per_s_n);
  cut.threshold_n = table.number("threshold_n", kThresholdN).value_or(cut.threshold_n);
  cut.friction = table.number("friction", kFriction).value_or(cut.friction);
  if (table.is_text("rate_per_s")) {
    static_cast<void>(table.choice("rate_per_s", kCutRateWords));
    scene.cut_in_one_tick = true;
  } else {
    scene.cut.rate_per_s = table.number("rate_per_s", kCutRatePerS).value_or(scene.cut.rate_per_s);
  }
  scene.cut.p1_n_per_mm2 =
      table.number("p1_n_per_mm2", kPressureNPerMm2).value_or(scene.cut.p1_n_per_mm2);
}

void read_spindle_table(const SceneTable& table, Scene& scene) {
  if (scene.cut.model != CutModel::preston) {
    refuse(table.place(),
           " turns nothing: only cut.model = \"preston\" has a spindle; leave it out");
  }
  SpindleSettings& spindle = scene.spindle;
  spindle.speed_krpm = table.number("speed_krpm", kSpeedKrpm).value_or(spindle.speed_krpm);
  spindle.stall_torque_n_mm =
      table.number("stall_torque_n_mm", kStallTorqueNMm).value_or(spindle.stall_torque_n_mm);
  spindle.inertia_g_mm2 =
      table.number("inertia_g_mm2", kInertiaGMm2).value_or(spindle.inertia_g_mm2);
}

/// The paper's force knows no normal that could cut by force: unless its scene says another model
/// of cutting, it comes with the paper's own.
void read_models(const SceneTable& root, Scene& scene) {
  if (const auto table = root.table("force", kForceKeys)) read_force_table(*table, scene.force);
  if (scene.force.model == ForceModel::paper) scene.cut.model = CutModel::overlap;
  if (const auto table = root.table("cut", kCutKeys)) read_cut_table(*table, scene);
  if (const auto table = root.table("spindle", kSpindleKeys)) read_spindle_table(*table, scene);
}

/// The overlap models cut whatever they meet.
void refuse_uncut(const Scene& scene) {
  if (scene.cut.model == CutModel::none || scene.cut.model == CutModel::preston) return;
  for (const Material& material : scene.materials) {
    if (!material.forbidden) continue;
    refuse(scene.path, ": material " + material.name +
                           " is forbidden, and this cut.model cuts everything; set model "
                           "= \"preston\", or leave forbidden out");
  }
}

void read_limits_table(const SceneTable& table, LimitSettings& limits) {
  limits.force_n = table.number("force_n", kForceN).value_or(limits.force_n);
  limits.slew_n_per_ms = table.number("slew_n_per_ms", kSlewNPerMs).value_or(limits.slew_n_per_ms);
  limits.speed_mm_per_s =
      table.number("speed_mm_per_s", kSpeedMmPerS).value_or(limits.speed_mm_per_s);
  limits.continuous_force_n = table.number("continuous_force_n", {kForceN.lo, limits.force_n})
                                  .value_or(std::min(limits.continuous_force_n, limits.force_n));
}

void read_servo_table(const SceneTable& table, ServoSettings& servo) {
  servo.rate_hz = table.whole("rate_hz", kRateHz).value_or(servo.rate_hz);
  read_choice(table, "numeric", kNumericWords, servo.numeric);
  read_choice(table, "kernel", kGradientWords, servo.kernel);
}

/// Names tell volumes and tools apart in pictures and reports.
template <class Spec>
void refuse_second(const SceneTable& table, const std::string& name,
                   const std::vector<Spec>& earlier) {
  if (std::none_of(earlier.begin(), earlier.end(),
                   [&](const Spec& other) { return other.name == name; })) {
    return;
  }
  refuse(table.place(), " is the second named \"" + name + "\"; write another name = \"..\"");
}

Scene read_scene(const toml::table& parsed, const std::filesystem::path& path) {
  Scene scene;
  scene.path = path.string();
  scene.materials = default_materials();
  const SceneTable root(parsed, "", path.string(), kRootKeys);

  for (const SceneTable& table : root.tables("volume", kVolumeKeys, kMaxVolumes)) {
    VolumeSpec volume = read_volume_table(table);
    refuse_second(table, volume.name, scene.volumes);
    scene.volumes.push_back(std::move(volume));
  }
  if (scene.volumes.empty()) {
    refuse(path.string(), ": no [[volume]]; write one with file = \"phantom\" or a path");
  }
  if (std::none_of(scene.volumes.begin(), scene.volumes.end(),
                   [](const VolumeSpec& volume) { return volume.solid; })) {
    refuse(path.string(), ": no [[volume]] is solid; set solid = true for what is to be felt");
  }
  for (const SceneTable& table : root.tables("tool", kToolKeys, kMaxTools)) {
    ToolSpec tool = read_tool_table(table);
    refuse_second(table, tool.name, scene.tools);
    scene.tools.push_back(std::move(tool));
  }
  if (scene.tools.empty()) {
    refuse(path.string(), ": no [[tool]]; write one with shape = \"ball\" and size_vox = 16");
  }

  for (const SceneTable& table : root.tables("material", kMaterialKeys, kMaxMaterials)) {
    read_material_table(table, scene.materials);
  }
  if (const auto table = root.table("device", kDeviceKeys)) read_device_table(*table, scene);
  read_models(root, scene);
  refuse_uncut(scene);
  if (const auto table = root.table("limits", kLimitKeys)) read_limits_table(*table, scene.limits);
  if (const auto table = root.table("servo", kServoKeys)) read_servo_table(*table, scene.servo);
  if (const auto table = root.table("hand", kHandKeys)) {
    if (const auto script = table->text("script")) {
      scene.hand_script = (path.parent_path() / *script).string();
    }
  }
  return scene;
}

}  // namespace

Scene parse_scene(std::string_view text, const std::filesystem::path& path) {
  const toml::parse_result parsed = toml::parse(text, path.string());
  if (parsed) return read_scene(parsed.table(), path);
  const toml::parse_error& error = parsed.error();
  const auto at = error.source().begin;
  refuse(path.string() + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
         ": " + std::string(error.description()) + "; correct the TOML syntax here");
}

Scene parse_scene_file(const std::filesystem::path& path) {
  constexpr std::uintmax_t kLargestFile = std::uintmax_t{1} << 20;
  std::error_code fault;
  if (std::filesystem::is_directory(path, fault)) {
    refuse(path.string(), ": is a folder; name a scene file in it");
  }
  if (!std::filesystem::is_regular_file(path, fault)) {
    refuse(path.string(), ": no such scene file; name one, for example scenes/phantom.toml");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, fault);
  if (fault || size > kLargestFile) {
    refuse(path.string(), ": not a scene file, it is larger than 1 MiB; name a scene file");
  }
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) refuse(path.string(), ": cannot be read; check its permissions");
  return parse_scene(text, path);
}

}  // namespace kerf
