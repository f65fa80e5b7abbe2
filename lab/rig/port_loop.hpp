// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <vector>

#include "controller/law/law.hpp"
#include "controller/law/velocity_estimators.hpp"
#include "controller/servo/energy_ledger.hpp"
#include "controller/servo/force_limits.hpp"

namespace kerf {

/// A hand that pushes a device against a sampled wall along one axis: the smallest loop that goes
/// unstable. The wall fills y < 0, the push points down.
struct PortLoop {
  double mass_kg = 0.1;
  double damping_ns_per_m = 0.2;  ///< of the device
  double push_n = 1;
  double let_go_s = 1e9;  ///< from here on the hand pulls away with `push_n`
  double start_mm = 0;    ///< at rest
  double stiffness_n_per_mm = 20;
  double rate_hz = 1000;
  double quantum_mm = 0;  ///< of the encoder, rounded down; 0: none
  bool limits = false;    ///< peak, thermal and slew limit of the Omni
  double seconds = 3;
  double longest_mm = 1000;  ///< farther off the loop counts as diverged, and ends
};

/// The outcome of a `PortLoop`.
struct PortLoopRun {
  std::vector<double> at_mm;    ///< of each tick
  std::vector<double> force_n;  ///< sent in it, up
  double peak_n = 0;
  double port_minimum_mj = 0;    ///< of the ledger
  double port_mj = 0;            ///< at the end
  double damped_mj = 0;          ///< by the device's own damping, exact
  double least_total_mj = 0;     ///< lowest sum of both
  double lowest_account_mj = 0;  ///< of `passivity`: what it holds for booked
  bool diverged = false;

  [[nodiscard]] double deepest_mm() const { return -*std::ranges::min_element(at_mm); }
  [[nodiscard]] double farthest_mm() const {
    return std::abs(*std::ranges::max_element(at_mm, {}, [](double mm) { return std::abs(mm); }));
  }
  /// Peak to peak in the last third.
  [[nodiscard]] double swing_mm() const {
    const auto last = at_mm.end() - static_cast<std::ptrdiff_t>(at_mm.size() / 3);
    const auto [low, high] = std::minmax_element(last, at_mm.end());
    return *high - *low;
  }
};

/// No stabiliser.
template <class N>
struct NoStabiliser {
  struct State {};
  [[nodiscard]] DeviceVec<typename N::Real> step(const StabiliserInput<N>& in,
                                                 State&) const noexcept {
    return in.wanted_n;
  }
};

/// The servo's side of a `PortLoop`: the servo's own ledger, limits, velocity and order of the
/// output stage (docs/forces.md 5.4). `loop` and `stabiliser` outlive it.
template <class N, class Stabiliser>
class PortServo {
 public:
  using Real = typename N::Real;

  PortServo(const PortLoop& loop, const Stabiliser& stabiliser)
      : loop_(loop),
        stabiliser_(stabiliser),
        limits_{.peak_n = Real(3.3),
                .continuous_n = Real(0.88),
                .slew_n_per_tick = Real(500 / loop.rate_hz),
                .thermal_per_tick = typename N::Ratio(0.1 / loop.rate_hz)},
        velocity_{.rate_hz = static_cast<std::int32_t>(loop.rate_hz),
                  .stride = std::max(1, static_cast<std::int32_t>(loop.rate_hz) / 1000),
                  .noise_mm = Real(loop.quantum_mm / 2)},
        last_mm_(up(loop.start_mm)) {
    window_.start(last_mm_);
  }

  /// One tick at `seen_mm`, the encoder's position. Returns the force that is sent, up.
  double step(double seen_mm) {
    const DeviceVec<Real> at_mm = up(seen_mm), moved_mm = at_mm - last_mm_;
    last_mm_ = at_mm;
    ledger_.move(sent_n_, moved_mm, 1);
    window_.take(at_mm, 1);
    const bool leaves = dot(sent_n_, moved_mm) > Real(0);
    const auto spring_n =
        up(loop_.stiffness_n_per_mm * std::max(0.0, -static_cast<double>(at_mm.y)));
    const auto limited = [&](DeviceVec<Real> force_n, ThermalState<N>& heat) {
      return loop_.limits ? limited_force(limits_, heat, force_n, sent_n_, leaves) : force_n;
    };
    ThermalState<N> heated = thermal_;
    const auto limited_n = limited(spring_n, heated);
    const auto steady_n =
        stabiliser_.step({limited_n, sent_n_, moved_mm, 1, window_.velocity(velocity_),
                          ledger_.total_mj(), spring_n.y > Real(0)},
                         state_);
    sent_n_ = steady_n == limited_n ? limited_n : limited(steady_n, thermal_);
    if (steady_n == limited_n) thermal_ = heated;
    const ForceParts<N> parts{.contact = true,
                              .spring = spring_n,
                              .limits = limited_n - spring_n + (sent_n_ - steady_n),
                              .stabiliser = steady_n - limited_n};
    ledger_.split(parts);
    ledger_.send(parts);
    return static_cast<double>(sent_n_.y);
  }

  [[nodiscard]] double port_mj() const { return mj(ledger_.total_mj()); }
  [[nodiscard]] double port_minimum_mj() const { return mj(ledger_.lowest_mj()); }
  /// Of `passivity`; 0 for a stabiliser without an account.
  [[nodiscard]] double account_mj() const {
    if constexpr (requires(typename Stabiliser::State state) { state.account_mj; }) {
      return mj(state_.account_mj);
    } else {
      return 0;
    }
  }

 private:
  static DeviceVec<Real> up(double y) { return {Real(0), static_cast<Real>(y), Real(0)}; }
  static double mj(typename N::Energy energy) {
    return N::kIsFixed ? static_cast<double>(energy) / kEnergyStepsPerMj
                       : static_cast<double>(energy);
  }

  const PortLoop& loop_;
  const Stabiliser& stabiliser_;
  ForceLimits<N> limits_;
  VelocityPlan<N> velocity_;
  ThermalState<N> thermal_;
  EnergyLedger<N> ledger_;
  VelocityWindow<N> window_;
  typename Stabiliser::State state_;
  DeviceVec<Real> sent_n_{}, last_mm_;
};

/// Runs the loop; the device between two ticks by its exact solution.
template <class N, class Stabiliser>
[[nodiscard]] PortLoopRun run_port_loop(const PortLoop& loop, const Stabiliser& stabiliser) {
  const double period_s = 1 / loop.rate_hz, m = loop.mass_kg, b = loop.damping_ns_per_m;
  const double decay = std::exp(-b / m * period_s);
  const auto ticks = static_cast<int>(std::lround(loop.seconds * loop.rate_hz));

  PortLoopRun run;
  PortServo<N, Stabiliser> servo(loop, stabiliser);
  double y_mm = loop.start_mm, v_mm_per_s = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    const double seen_mm =
        loop.quantum_mm > 0 ? std::floor(y_mm / loop.quantum_mm) * loop.quantum_mm : y_mm;
    run.force_n.push_back(servo.step(seen_mm));
    run.at_mm.push_back(y_mm);
    run.peak_n = std::max(run.peak_n, std::abs(run.force_n.back()));
    run.lowest_account_mj = std::min(run.lowest_account_mj, servo.account_mj());
    run.least_total_mj = std::min(run.least_total_mj, servo.port_mj() + run.damped_mj);
    run.diverged = std::abs(y_mm) > loop.longest_mm;
    if (run.diverged) break;

    // m dv/dt = F - b v, F constant: the speed falls to F / b, the rest of the work is damped.
    const double push_n = tick * period_s < loop.let_go_s ? -loop.push_n : loop.push_n;
    const double force_n = run.force_n.back() + push_n;
    const double end_mm_per_s = force_n / b * 1000, v = v_mm_per_s;
    v_mm_per_s = end_mm_per_s + (v - end_mm_per_s) * decay;
    const double moved = end_mm_per_s * period_s + (v - v_mm_per_s) * m / b;
    y_mm += moved;
    run.damped_mj += force_n * moved + m / 2000 * (v * v - v_mm_per_s * v_mm_per_s);
  }
  run.port_mj = servo.port_mj();
  run.port_minimum_mj = servo.port_minimum_mj();
  return run;
}

}  // namespace kerf
