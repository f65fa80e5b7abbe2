// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/scene.hpp"

// How stiff a sampled wall may be on a device: exact boundaries and passivity bounds of one axis,
// runs of a hand that pushes against it, and maps of such runs. docs/forces.md 5.7 derives the
// formulas, docs/stability.md has the maps.
//
//     kerf::SampledLoop loop = kerf::device_loop("falcon", 1000);
//     const double linear = kerf::highest_stiffness(loop, 0.004);
//     const auto map = kerf::stability_map("0.5:20:12",
//                                          {{"device", "falcon"}, {"damping", "0,0.004"}});
//     std::printf("%g %g N/mm\n", linear, map.columns[1].first_swing_n_per_mm);

namespace kerf {

/// A hand that never lets the device go: its mass moves with the tip, its spring and damper go to
/// ground. All zero: no hand, which is the worst case for stability.
struct SampledHand {
  double mass_kg = 0;
  double damping_ns_per_mm = 0;
  double stiffness_n_per_mm = 0;
};

/// One axis of a haptic device in contact with a virtual wall: a mass that gets, once per period,
/// the force F = -K x - B v of the tick before, held until the next one.
///
/// Linear except for `coulomb_n` and `quantum_mm`: the exact limits below ignore both,
/// `quantum_stiffness` and runs use them. No structural mode: a bound of this model
/// does not hold above the device's first resonance. Mass and period are positive, the rest is not
/// negative; a program that reads them from a file has to check that.
struct SampledLoop {
  double mass_kg = 0.045;      ///< apparent, at the tip
  double viscous_ns_per_mm{};  ///< damping of the device itself, b
  double period_s = 0.001;     ///< T
  /// From the reading of the encoder to the moment at which its force acts; any part of a period,
  /// up to `kMaxDelayPeriods`.
  double delay_s = 0;
  /// Time constant of a first-order low-pass (backward Euler) after the backward difference of the
  /// position; 0: none. A window of n ticks is about as late as a constant of n/2 periods.
  double velocity_filter_s = 0;
  SampledHand hand;
  double coulomb_n = 0;   ///< Coulomb friction at the tip
  double quantum_mm = 0;  ///< of the encoders, at the tip
};

/// Longer delays are clamped to this one.
inline constexpr double kMaxDelayPeriods = 64;

/// What of a loop no device has, as "mass_kg = 0: give a positive one"; empty if nothing. The exact
/// functions and bounds below mean something for loops without a problem alone; runs refuse others.
[[nodiscard]] std::string problem_in(const SampledLoop& loop);

/// The loop of a device ("omni", "falcon", "woodenhaptics", "inverse3", "touch", "omega") by the
/// figures of docs/gains.md, without a hand: a light grip is the worst case. Or of a file of
/// `kerf identify`, whose name ends in .toml, in a direction: MapOptions. Throws Error for another
/// name, a file that is no device, or a rate that is not positive.
[[nodiscard]] SampledLoop device_loop(std::string_view device, double rate_hz,
                                      std::string_view direction = {});

// Limits of the gains of a sampled wall (docs/forces.md 5.7).
//
// Passivity: bounds for every hand, or short formulas. Passive is more than stable: a passive wall
// never gives energy, whatever the hand does. The hand of the loop is not used.

/// The device damping (N s/mm) above which the wall is passive, by a scan of the circle: Colgate
/// and Schenkel's (T/2) max_w Re[(1 - e^-jwT) H(e^jwT)] / (1 - cos wT), and, if the delay has a
/// part of a period, the energy that a hand gains between two samples (docs/forces.md 5.7). Never
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

// What a hand feels that moves the tip as a sine (docs/forces.md 5.8): force over velocity, N s/mm,
// of the fundamental. Re Z is the damping that it feels, -w Im Z the stiffness. Of a linear wall,
// up to half of the servo's rate.

/// Of the rendered wall, with hold, delay and filter. Device, hand and encoder steps do not count.
[[nodiscard]] std::complex<double> wall_impedance(const SampledLoop& loop,
                                                  double stiffness_n_per_mm,
                                                  double damping_ns_per_mm, double hz);

/// Of the device without a wall: its mass, its damping, and its Coulomb friction in a motion of
/// this amplitude. At the port a hand feels the sum of both.
[[nodiscard]] std::complex<double> device_impedance(const SampledLoop& loop, double hz,
                                                    double amplitude_mm);

// Runs.

/// The verdict on a run. A run with none of the four flags is proven to be at rest.
struct LimitCycle {
  /// In both halves of the last half of the run the tip reverses at least twice, each time after
  /// more than one encoder step, and its travel does not fall. Or the run cannot go on.
  bool swings = false;
  /// In both halves of the last half the motors give more energy than a push over one encoder step
  /// takes, and neither this nor the travel falls.
  bool active = false;
  /// Neither: but travel or energy of the last half is above one encoder step.
  bool undecided = false;
  /// None of them: but rounding of fixed numbers keeps up a motion that rests in double
  /// (`MapSpec`).
  bool arithmetic = false;
  double travel_mm = 0;  ///< in the last half; 0: held by friction
  double given_mj = 0;   ///< by the motors to tip and hand: rise of the maximum in the last half
  double port_minimum_mj = 0;  ///< lowest energy of the device port in a run that begins at 0

  /// Proven.
  [[nodiscard]] bool rests() const noexcept {
    return !(swings || active || undecided || arithmetic);
  }
  /// The worst that a run can show: no further run changes it.
  [[nodiscard]] bool worst() const noexcept { return swings && active; }
  /// The worse of two runs.
  void join(const LimitCycle& other) noexcept {
    swings = swings || other.swings;
    active = active || other.active;
    undecided = undecided || other.undecided;
    arithmetic = arithmetic || other.arithmetic;
    travel_mm = std::max(travel_mm, other.travel_mm);
    given_mj = std::max(given_mj, other.given_mj);
    port_minimum_mj = std::min(port_minimum_mj, other.port_minimum_mj);
  }
};

/// One run of a hand against a wall: it meets it at a speed and goes on pushing. In a map, seed s
/// and hit number h (0, 50, 200 mm/s) have `seed` = s 2^32 + h.
struct WallRun {
  SampledLoop loop;
  double stiffness_n_per_mm = 1;
  double damping_ns_per_mm = 0;
  double push_n = 0.5;      ///< of the hand, above Coulomb friction
  double hit_mm_per_s = 0;  ///< at the start
  double start_mm = 0.1;    ///< before the wall
  double seconds = 60;      ///< to which a run that is still open is followed
  /// Shifts the steps of the encoder against the wall; 0: an edge is on it.
  std::uint64_t seed = 1;
  std::string law = "coupling";    ///< or "linear", "two_sided", or the name of a law
  std::string estimator = "foaw";  ///< a velocity estimator of docs/forces.md 5.2
  bool fixed_point = true;         ///< the servo's numbers; else double
  bool limits = true;              ///< peak and slew of the default device
};

/// Runs it with the servo's own law, estimator and limits in its own numbers: a cell of a map. The
/// same value gives the same bits. Throws Error for a law or estimator that does not exist.
[[nodiscard]] LimitCycle run_on_wall(const WallRun& run);

/// Runs it, and calls `watch` in each tick: how far out of the wall the tip is, and its speed
/// outwards. What it throws ends the run, and comes out as it is.
using WallWatch = std::function<void(double tip_mm, double mm_per_s)>;
[[nodiscard]] LimitCycle run_on_wall(const WallRun& run, const WallWatch& watch);

/// An axis of a map and its values, as the options of `kerf lab zwidth`: {"device", "omni,falcon"},
/// or one file as {"device", "device.toml"}; {"damping", "0:0.02:5"} (from:to:count).
struct MapAxis {
  std::string name, values;
};

/// One combination of the axes' values, at all stiffnesses.
struct MapColumn {
  std::vector<std::string> values;  ///< by axis as given
  std::vector<LimitCycle> cells;    ///< by stiffness: the worst of all presses and seeds
  std::string impossible;           ///< why it has no cells; empty: it has
  /// The lowest stiffness, within 0.5 %, at which a press of any seed oscillates, or gives energy;
  /// 0: the lowest of all does; infinite: none does.
  double first_swing_n_per_mm = 0, first_energy_n_per_mm = 0;
  /// Lowest stiffness of each seed alone; one entry, if the loop's encoders have no steps that it
  /// shifts.
  std::vector<double> swing_by_seed_n_per_mm, energy_by_seed_n_per_mm;
};

struct StabilityMap {
  std::vector<double> stiffness_n_per_mm;
  std::vector<MapColumn> columns;  ///< the last axis turns fastest
};

struct MapOptions {
  double seconds = 60;  ///< to which a run that is still open is followed, at least
  std::uint64_t seed = 1;
  std::size_t seeds = 5;    ///< so many, one after the other
  std::size_t threads = 0;  ///< 0: one for each core; the map is the same
  /// Ends the map when another thread sets it: columns that are not done then have no cells.
  const std::atomic<bool>* stop = nullptr;
  /// Of a device that is a file: "x", "y", "z", such as "1,0,1", or "worst", as if empty, the one
  /// with the lowest stiffness that any push makes oscillate, by docs/forces.md 5.7.
  std::string direction{};
};

/// The map of `kerf lab zwidth`, whose options are the axes: `kerf lab zwidth --help` lists names
/// and values. `stiffness` is "0.05:50:40", even in the ratio, or a list in N/mm. Takes seconds to
/// hours: docs/stability.md. Throws Error for an axis or a value that cannot be.
[[nodiscard]] StabilityMap stability_map(std::string_view stiffness,
                                         const std::vector<MapAxis>& axes,
                                         const MapOptions& options = {});

/// The loop of a column: `axes` have one value each, the other ones their standards. So it has the
/// figures of the emulated device, as maps have. `direction`: MapOptions. Throws Error.
[[nodiscard]] SampledLoop column_loop(const std::vector<MapAxis>& axes,
                                      std::string_view direction = {});

}  // namespace kerf
