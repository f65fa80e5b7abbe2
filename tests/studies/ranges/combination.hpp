// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/servo.hpp"
#include "lab/run/child_process.hpp"
#include "tests/studies/ranges/key_levels.hpp"
#include "tests/studies/ranges/rules.hpp"

/// One scene of any combination of values: its input, its run, and the rules that it must keep.
namespace kerf::ranges {

/// A state that the servo must have reached after a tick.
struct Expectation {
  enum class Kind { active, faded, armed } kind;
  std::size_t tick;
};

/// The hardest input of one scene: reports that park, leave, press, slide and turn, are lost, come
/// twice, jump, are nonsense, stop, and recover from all of that by parking, twice. Ends in a
/// press.
struct StressInput {
  std::vector<DeviceReport> reports;
  std::vector<Expectation> expectations;
  std::size_t recovered = 0;  ///< tick after the last disturbance at which it is armed again
};

/// `scene` has volumes. About 0.75 s at its rate. The start lies above the solid at the device's
/// origin; the press goes three voxels into it, or as deep as the speed limit allows.
[[nodiscard]] StressInput hard_hand(const LoadedScene& scene);

/// The files that scenes of a run name, in a folder that goes with this: a half space of 32^3
/// voxels of 0.25 mm with air above it, labelled enamel over dentin, and the mesh of a bur.
class SceneFolder {
 public:
  SceneFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }

 private:
  sweep::PrivateFolder folder_;
};

/// The outcome of one scene.
struct SceneOutcome {
  bool refused = false;
  std::string refusal;
  std::vector<Violation> violations;
  bool felt = false, cut = false, faulted = false;
  std::size_t ticks = 0;
};

/// Loads the scene of these values in these numbers and plays the hard hand to it. Rules besides
/// those of every tick (rules.hpp):
///
///   line       a refusal of the loader is one line "place: value; way out"
///   faded      after 25 ms of silence the motors are off, without force
///   armed      50 ms parked at rest forgive every fault
///   active     100 ms after it was picked up the motors are on, if they are known
///   removed    densities fall by exactly the amount that the ticks reported
///   again      a second servo gives the same bits for the same reports
///   recovered  a servo restored from the state after the last recovery gives the same bits
///
/// `file` is written and read; one for each thread.
[[nodiscard]] SceneOutcome run_combination(const KeyTexts& texts, NumericKind numeric,
                                           const std::filesystem::path& file);

/// Loads it only, and reports the refusal if there is one.
[[nodiscard]] SceneOutcome load_combination(const KeyTexts& texts, NumericKind numeric,
                                            const std::filesystem::path& file);

}  // namespace kerf::ranges
