// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Where to begin reading kerf's own code: docs/architecture.md is the map. A scene is the text of a
// file; controller/scene checks it key by key, controller/load adds its volumes and tools, and
// controller/plan makes plan and memory of the servo of it. `servo_step` in controller/servo is one
// tick: sense, wanted_force, force_to_send, motor_command, cut, follow_cuts. controller/kernel has
// the physics of a tick as templates over the numbers. controller/loop runs the step against a
// clock and a device, record/ and replay/ write its ticks down and repeat them, hil/ is the device
// and the hand that stand in for real ones, lab/ measures. face/ has the code of these headers.

namespace kerf {

/// What is wrong with a file, a setting or a recording: one line, "location: value; way out".
/// Thrown by all that reads and checks, and never by a tick.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One key of docs/scene-keys.md each, as `table.key=VALUE`, where VALUE is TOML, such as
/// "force.stiffness_n_per_mm=0.6" or "force.law=\"mine\"". It takes the place of what the file has.
using Settings = std::vector<std::string>;

// An object that was moved from may only be assigned to, or destroyed: in all of these headers.

/// Densities of a volume from memory, x fastest: 0 is air, 65535 is full. The scene treats them as
/// those of a file: it crops them to the solid with a border of air, smooths noise, and turns the z
/// axis up (world y), unless its [[volume]] has `crop = false`, `denoise = "off"` and an
/// `orientation`. `VoxelView` says where the voxels of a servo lie.
struct Voxels {
  std::array<int, 3> size{};  ///< along x, y, z: up to 1024 each, 512 Mi in all
  std::array<double, 3> spacing_mm{0.1, 0.1, 0.1};  ///< 1 nm to 1 m
  std::span<const std::uint16_t> density{};         ///< size[0] * size[1] * size[2] of them
};

/// A scene, loaded and checked. Immutable; any number of servos may be made of one, in any thread.
///
///     const auto scene = kerf::Scene::load("touch.toml", {"force.stiffness_n_per_mm=0.6"});
///     std::puts(scene.explain().c_str());
///
/// A scene without `device.torque_scale` gets that of the emulated device, as `./kerf demo` does. A
/// real unit differs: `kerf-controller --probe` measures it.
class Scene {
 public:
  /// The scene in a file, with all files that it names. Takes a second for the default phantom.
  /// Throws Error.
  [[nodiscard]] static Scene load(const std::filesystem::path& file, const Settings& settings = {});

  /// The scene in a text; files that it names are in `folder`. Throws Error.
  [[nodiscard]] static Scene parse(std::string_view text, const std::filesystem::path& folder,
                                   const Settings& settings = {});

  /// The scene in a text, with these densities as the first [[volume]]. Its `file` is a name for
  /// messages; what says how a file is read (`window`, `spacing_mm`, `override_spacing_mm`, a
  /// phantom) is refused. Throws Error.
  [[nodiscard]] static Scene of_voxels(const Voxels& first, std::string_view text,
                                       const Settings& settings = {});

  /// Devices, each with a tool: 1 or 2.
  [[nodiscard]] std::size_t arms() const noexcept;
  [[nodiscard]] int rate_hz() const noexcept;
  /// By their numbers.
  [[nodiscard]] std::vector<std::string> volumes() const;
  [[nodiscard]] std::vector<std::string> tools() const;

  /// Why the servo cannot keep the scene's rate on the reference machine; empty if it can. In
  /// lock-step it need not.
  [[nodiscard]] std::string over_budget() const;
  /// Cost of a tick by method and stage, memory, highest rate and stability, as text; times ticks
  /// on this machine for about a second. Throws Error.
  [[nodiscard]] std::string explain() const;
  /// All that determines a run, as JSON on one line: the same text on every machine. Its hash is
  /// `config_hash` of logs and segments.
  [[nodiscard]] std::string json() const;

  struct Loaded;  ///< not for programs
  explicit Scene(std::shared_ptr<const Loaded> loaded) noexcept : loaded_(std::move(loaded)) {}
  [[nodiscard]] const Loaded& loaded() const noexcept { return *loaded_; }

 private:
  std::shared_ptr<const Loaded> loaded_;
};

}  // namespace kerf
