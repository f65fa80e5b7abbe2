// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/scene/tool_shapes.hpp"
#include "controller/servo/servo_limits.hpp"

namespace kerf {

inline constexpr double kMinWorkspaceScale = 0.01, kMaxWorkspaceScale = 100;
inline constexpr double kLargestWorldMm = 10000;  ///< a third of the range of the loop's numbers
inline constexpr double kMinTorqueScale = 1e-3;   // N mm per count
inline constexpr double kMaxTorqueScale = 10;
inline constexpr int kMinRateHz = 250;            // slower than the hand can be held stable
inline constexpr int kMaxRateHz = 8000;           // one tick per cycle of the FireWire bus
inline constexpr std::size_t kMaxMaterials = 32;  // labels are small indices

/// The `file` of a [[volume]] that is computed instead of read.
inline constexpr std::string_view kPhantomFile = "phantom";

/// One [[volume]] as the scene file says it; `where` begins a complaint about what it holds.
struct VolumeSpec {
  std::string where;  ///< `file:line`
  std::string name;
  std::string file;                                 ///< as written
  std::optional<VoxelGrid> phantom_size;            ///< only with file = "phantom"
  std::optional<std::array<double, 3>> spacing_mm;  ///< none: what the file says
  std::optional<std::array<double, 2>> window;      ///< source values of density 0 and 1
  std::optional<double> iso;                        ///< density 0..1; none: Otsu's threshold
  bool crop = true;
  bool solid = true;
  std::array<double, 3> position_mm{0, 0, 0};        ///< world place of the middle of its box
  std::optional<std::array<double, 4>> orientation;  ///< world from source; none: z axis up
};

/// One [[tool]] as the scene file says it; the places begin complaints about size and pitch.
struct ToolSpec {
  std::string where;  ///< `file:line`, of a mesh
  std::string size_place, pitch_place;
  std::string name;
  std::string shape;
  std::string file;          ///< of a mesh, as written
  double scale = 1;          ///< mm per unit of the mesh
  bool pitch_given = false;  ///< else the smallest voxel of what can be touched
  ToolSize size;
  bool turns = true;
};

/// A scene file after parsing: every value checked alone, nothing loaded yet.
struct SceneSpec {
  std::filesystem::path path;
  std::vector<VolumeSpec> volumes;
  std::vector<ToolSpec> tools;
  std::vector<Material> materials;
  Scene::Device device;
  bool offset_given = false;  ///< else the device origin is put on the first surface
  Scene::Force force;
  Scene::Cut cut;
  Scene::Spindle spindle;
  bool cut_in_one_tick = false;  ///< rate_per_s = "1/T", the paper's own step
  Scene::Limits limits;
  Scene::Servo servo;
  std::string hand_script;  ///< relative to the working directory
};

/// Reads TOML text. `path` is only used in messages and to resolve `script`. Throws SceneError, one
/// line with the line number, for anything that is not a valid scene. Any thread; load time only.
[[nodiscard]] SceneSpec parse_scene(std::string_view text, const std::filesystem::path& path);

/// Reads a scene file of at most 1 MiB.
[[nodiscard]] SceneSpec parse_scene_file(const std::filesystem::path& path);

}  // namespace kerf
