// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "controller/stability/sampled_loop.hpp"

namespace kerf {

/// Gains between which a loop is stable, in the gain's unit.
struct StableBand {
  double from = 0;
  double to = 0;
};

// The exact stability of a sampled wall (docs/theory.md 5.7): zero-order hold by the matrix
// exponential, delay of any part of a period, Schur-Cohn test of the characteristic polynomial, in
// double. A boundary is found by a scan in steps of 2 % and a bisection to the last bits, so a band
// that is narrower than 2 % can be missed; none is known. For load time and for the lab: each call
// takes some 0.1 ms and allocates.

/// Whether every motion of the loop dies out. On the boundary: false.
[[nodiscard]] bool is_stable(const SampledLoop& loop, double stiffness_n_per_mm,
                             double damping_ns_per_mm);

/// All bands of K > 0 at this damping B >= 0, from the lowest up. The first begins at 0 unless the
/// damping alone is unstable; what follows are re-entries. Empty: never stable.
[[nodiscard]] std::vector<StableBand> stable_stiffnesses(const SampledLoop& loop,
                                                         double damping_ns_per_mm);

/// The first crossing: the largest K (N/mm) below which all K > 0 are stable; 0: none is.
[[nodiscard]] double highest_stiffness(const SampledLoop& loop, double damping_ns_per_mm);

/// The largest B (N s/mm) that is stable without any stiffness (K -> 0): no wall may have more.
[[nodiscard]] double highest_damping(const SampledLoop& loop);

}  // namespace kerf
