// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "controller/scene/scene.hpp"

/// Energy at the device port: work of closed loops, and the cost and feel of stabilisers.
namespace kerf::energy {

/// Work of the hand around closed paths on a static ball, by the servo's own ledger.
struct LoopWork {
  std::string model;    ///< proxy, proxy with friction, paper
  std::string numeric;  ///< fixed, double
  /// |SUM dW| / SUM |dW| of the contact force as if never sampled: 0 for a force with a potential.
  double share = 0;
  double friction_mj = 0;  ///< a loop; taken from the hand
  double leak_mj = 0;      ///< a loop; of the sample and hold
  double most_share = 0;   ///< that `share` may have
};

/// A ball tool of radius 1 mm, pressed 0.6 mm into a ball of radius 3 mm, goes round six tilted
/// circles of radius 0.375 mm, two laps each; the second lap counts. Nothing is cut. No mechanics:
/// the encoder counts are those of the hand's position.
[[nodiscard]] std::vector<LoopWork> closed_loops();

/// Time added to each tick in contact.
struct TickCostRow {
  std::string name;
  std::string numeric;
  double ns = 0;  ///< mean of the fastest of 9 rounds
};

/// Of the ledger with its observer and the split of the spring, and of each stabiliser.
[[nodiscard]] std::vector<TickCostRow> ledger_costs();

/// A sampled wall with one stabiliser as a hand feels it: pushed onto it by 1 N from 0.1 mm
/// above, let go after 2 s of 3. Fixed point, 1 kHz, encoder and limits of an Omni.
struct Feel {
  std::string hand{};  ///< bare, or gripped
  double stiffness_n_per_mm = 0;
  std::string stabiliser{};
  double peak_n = 0;
  double delay_ms = 0;  ///< from the touch to half of the push; 3000: never
  double depth_mm = 0;  ///< mean of the last half second before it is let go
  double swing_mm = 0;  ///< peak to peak there: the oscillation that stays
  double air_n = 0;     ///< largest force in the air once it is let go: drag
  double port_minimum_mj = 0;
};

[[nodiscard]] std::vector<Feel> stabiliser_feel();

}  // namespace kerf::energy
