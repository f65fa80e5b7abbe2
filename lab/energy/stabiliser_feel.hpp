// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace kerf::energy {

/// What a hand feels of a sampled wall with one stabiliser: pushed onto it by 1 N from 0.1 mm
/// above, let go after 2 s of 3. Fixed point, 1 kHz, encoder and limits of an Omni.
struct Feel {
  std::string hand{};  ///< bare, or gripped
  double stiffness_n_per_mm = 0;
  std::string stabiliser{};
  double peak_n = 0;
  double delay_ms = 0;  ///< from the touch to half of the push; 3000: never
  double depth_mm = 0;  ///< mean of the last half second before it is let go
  double swing_mm = 0;  ///< peak to peak there: what goes on swinging
  double air_n = 0;     ///< largest force in the air once it is let go: drag
  double port_minimum_mj = 0;
};

[[nodiscard]] std::vector<Feel> stabiliser_feel();

}  // namespace kerf::energy
