// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "web/tab_viewer.hpp"

namespace kerf::web {

/// What a run is made from. All of it is text, because a tab has no files.
struct TabInputs {
  std::string scene_name;  ///< as a path of kerf's repository: "scenes/phantom.toml"
  std::string scene;       ///< the text of that file; its volumes are phantoms
  std::string hand;        ///< the text of a hand script; empty: only a user leads the hand
  std::string device;      ///< word of a personality: "omni"
  std::vector<std::string> settings;  ///< "table.key=VALUE", as of `--set`
  bool pedal = false;                 ///< `--pedal`: a hand that a user leads cuts by its button
};

/// A run in lock-step: controller, emulated device and hand, segment, and the messages of a bridge
/// to one viewer, all in one thread and without files, processes, sockets or a clock. The same
/// inputs give the same bits as `./kerf demo --virtual`.
///
/// The order: construct, then `step` and `slot` in turn; after `slot`, `next` until it returns
/// false.
class TabRun {
 public:
  /// Loads and plans the scene; a second or two for the default phantom. Throws LoadError or
  /// HilError, one line.
  explicit TabRun(const TabInputs& inputs);
  ~TabRun();
  TabRun(const TabRun&) = delete;
  TabRun& operator=(const TabRun&) = delete;

  /// Steps `ticks` times, but not beyond `most_armed` armed ticks: those since the device was taken
  /// in hand, as the seconds of `./kerf demo` count. Returns the steps made.
  int step(int ticks, std::uint64_t most_armed = UINT64_MAX) noexcept;

  [[nodiscard]] TabViewer& viewer() noexcept;

  /// Once its script has ended, the hand follows a point of the world, mm. `button` is the pedal.
  void lead(const std::array<double, 3>& world_mm, const std::array<double, 3>& orientation_rad,
            bool button) noexcept;
  /// The user is gone: the hand holds, then withdraws.
  void release() noexcept;

  [[nodiscard]] int rate_hz() const noexcept;
  /// JSON: rate_hz, ticks, armed_ticks, armed, output_hash, fault, phase, force_n,
  /// removed_density_mm3, energy_mj by source, absorbed_mj, hand_led. Cheap.
  [[nodiscard]] std::string facts() const;
  /// Hash of all volumes as in the report of a run, 16 hex digits. Reads every voxel.
  [[nodiscard]] std::string volume_hash() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf::web
