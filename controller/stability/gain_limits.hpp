// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/stability/sampled_loop.hpp"

namespace kerf {

// Limits of the gains of a sampled wall (docs/theory.md 5.7).
//
// Passivity: bounds for every hand, or short formulas. Passive is more than stable: a passive wall
// never gives energy, whatever the hand does. The hand of the loop is not used.

/// The device damping (N s/mm) above which the wall is passive, by a scan of the circle: Colgate
/// and Schenkel's (T/2) max_w Re[(1 - e^-jwT) H(e^jwT)] / (1 - cos wT), and, if the delay has a
/// part of a period, the energy that a hand gains between two samples (docs/theory.md 5.7). Never
/// below 0.
[[nodiscard]] double passive_viscosity(const SampledLoop& loop, double stiffness_n_per_mm,
                                       double damping_ns_per_mm);

/// The largest K (N/mm) that is passive on this device at this damping; 0: none.
[[nodiscard]] double passive_stiffness(const SampledLoop& loop, double damping_ns_per_mm);

/// min(2 b/T, 2 fc/D): up to here quantisation and sampling never give energy, for any hand (Abbott
/// and Okamura; B = 0, no delay). Without a quantum the first of the two.
[[nodiscard]] double quantum_stiffness(const SampledLoop& loop);

// Exact stability: zero-order hold by the matrix exponential, delay of any part of a period,
// Schur-Cohn test of the characteristic polynomial, in double. A boundary is found by a scan in
// steps of 2 % and a bisection to the last bits, so a band narrower than 2 % can be missed; none is
// known. For load time and for the lab: each call takes about 0.1 ms and allocates.

/// Whether every motion of the loop decays. On the boundary: false.
[[nodiscard]] bool is_stable(const SampledLoop& loop, double stiffness_n_per_mm,
                             double damping_ns_per_mm);

/// The first boundary at this damping B >= 0: the largest K (N/mm) below which all K > 0 are
/// stable; 0: none is.
[[nodiscard]] double highest_stiffness(const SampledLoop& loop, double damping_ns_per_mm);

/// The largest B (N s/mm) that is stable without any stiffness (K -> 0): no wall may have more.
[[nodiscard]] double highest_damping(const SampledLoop& loop);

}  // namespace kerf
