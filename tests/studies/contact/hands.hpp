// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "hil/device/hand_script.hpp"
#include "tests/studies/contact/rows.hpp"

namespace kerf::extremes {

/// One tick of a hand with the motors on.
struct HandTick {
  double height_mm = 0;        ///< of the tip over the surface first met, in the scene
  double proxy_height_mm = 0;  ///< of the tool as it is felt
  std::array<double, 3> force_n{};
  double removed_mm3 = 0;  ///< since the start
  bool contact = false;
  double compute_us = 0;  ///< of the servo step, ticks back to back
};

/// A scripted hand at an emulated Omni, its driver and the whole servo step in virtual time.
struct HandRun {
  std::string name;
  double rate_hz = 1000;
  std::vector<HandTick> ticks;
  std::uint64_t faults = 0;  ///< ticks in which one was latched
};

/// `scene` is for an Omni; its torque scale is set to that of the emulated unit. The same arguments
/// give the same run, except for its times; it has at least one tick. Throws HilError if the hand
/// does not reach the start of its script.
[[nodiscard]] HandRun run_hand(LoadedScene scene, const HandScript& hand, double seconds);

/// Force above a frequency, over the mean force, in windows of 128 ticks wholly in contact.
struct Chatter {
  double share = 0;  ///< of all windows together (Welch 1967); 0 if there is none
  double worst = 0;  ///< of a single one
  int windows = 0;
};
[[nodiscard]] Chatter chatter_of(const HandRun& run, double cutoff_hz);

/// From this frequency on, a change of the force is chatter, because no hand moves as fast.
inline constexpr double kChatterHz = 150;

/// scenes/NAME.toml with the phantom of this effort. Throws LoadError if it cannot be read.
[[nodiscard]] LoadedScene shipped_scene(const std::string& name, const Effort& effort);
/// The hand of scenes/hands/NAME.toml in it. Throws HilError if it cannot be read.
[[nodiscard]] HandRun run_hand(const LoadedScene& scene, const std::string& name,
                               const Effort& effort);

/// Five hands at an emulated Omni, two of which cut: no chatter in the contact.
[[nodiscard]] std::vector<HandRun> try_hands(const Effort& effort, const RowSink& add_row);

/// Both forces on a hand that presses straight into a wall, N.
struct Press {
  double depth_mm, paper_n, proxy_n;
};
/// For an update rate, the lowest speed at which a straight stroke can pass the face without one
/// tick of force. Up to 10 m/s, where the supervisor stops every hand.
struct Loss {
  double rate_hz;
  std::optional<double> paper_mm_per_s, proxy_mm_per_s;
};
struct Wall {
  std::string name;
  double thickness;  ///< voxels
  std::vector<Press> presses{};
  double paper_most_n = 0;     ///< of a slow press
  double paper_unfelt_mm = 0;  ///< of its way behind the face
  std::vector<Loss> losses{};
};

/// Both forces along one slide over a bump, over their means.
struct SlideTick {
  double travel_mm, paper, proxy;
};
struct Slide {
  std::vector<SlideTick> ticks;
  double paper_step = 0, proxy_step = 0;        ///< largest from tick to tick, over the mean
  double paper_degrees = 0, proxy_degrees = 0;  ///< largest to the normal
};

/// The paper's force and the swept proxy on the same motions, with the gains that scenes have by
/// default: a ball of 16 voxels of 0.1 mm.
struct Comparison {
  std::vector<Wall> walls{{"a wall of 5 mm", 50}, {"a wall of 2 voxels", 2}};
  Slide slide;
};

[[nodiscard]] Comparison compare(const Effort& effort, const RowSink& add_row);

}  // namespace kerf::extremes
