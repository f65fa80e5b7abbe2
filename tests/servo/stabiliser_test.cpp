// SPDX-License-Identifier: Apache-2.0
// The stabilisers on the smallest loop that goes unstable.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "controller/law/stabilisers.hpp"
#include "lab/rig/port_loop.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf::stabiliser_test {
namespace {

template <template <class> class Law, class N>
Law<N> law(double value, double rate_hz = 1000) {
  const std::array values{value};
  return Law<N>(LawSetup(rate_hz, 0, Law<N>::kSettings, values));
}

/// Inputs at the ends of every range, one after the other; `check` sees each with its answer.
template <class N, class Law, class Check>
void feed_extremes(const Law& law, Check&& check) {
  using Real = typename N::Real;
  typename Law::State state;
  std::mt19937 random(11);
  constexpr std::array kLengths{0.0, 1.0 / 65536, 1e-3, 0.055, 1.0, 300.0, 32767.0};
  const auto any = [&](std::size_t most) {
    const auto one = [&] {
      const double length = kLengths[random() % most];
      return static_cast<Real>(random() % 2 == 0 ? length : -length);
    };
    const Real x = one(), y = one(), z = one();
    return DeviceVec<Real>{x, y, z};
  };
  constexpr std::array<std::uint32_t, 6> kTicks{1, 1, 1, 2, 20, 1000};
  constexpr std::array kTakenMj{0.0,  -1e-9, 1e-9,          -0.5,        0.5,
                                -1e4, 1e4,   -2147483647.0, 2147483647.0};
  for (int i = 0; i < 100'000; ++i) {
    StabiliserInput<N> in;
    in.wanted_n = any(i % 8 == 0 ? 7 : 5);
    in.sent_n = any(5);
    in.moved_mm = any(i % 4 == 0 ? 7 : 5);
    in.ticks = kTicks[random() % kTicks.size()];
    in.velocity_mm_per_s = any(7);
    const double taken_mj = kTakenMj[random() % (i % 16 == 0 ? 9 : 7)];
    in.taken_mj = static_cast<typename N::Energy>(taken_mj * (N::kIsFixed ? kEnergyStepsPerMj : 1));
    in.contact = random() % 4 != 0;
    check(in, law.step(in, state), state);
  }
}

template <class Real>
std::array<double, 3> doubles(DeviceVec<Real> v) {
  return {double(v.x), double(v.y), double(v.z)};
}

/// S15: 0.1 kg and 0.2 N s/m against 20 N/mm, 50 times what it bears; a push of 1 N.
constexpr PortLoop kHardWall{};

}  // namespace

TEST_CASE_TEMPLATE(
    "S15: a wall far beyond the limit diverges, and is bounded by the passivity "
    "controller",
    N, FixedNumbers, DoubleNumbers) {
  const PortLoopRun off = run_port_loop<N>(kHardWall, NoStabiliser<N>{});
  CHECK(off.farthest_mm() > 100);
  CHECK(off.port_minimum_mj < -100);

  const PortLoopRun on = run_port_loop<N>(kHardWall, law<PassivityController, N>(0.1));
  CHECK(on.farthest_mm() < 2);
  CHECK(on.lowest_account_mj >= (sizeof(typename N::Real) == 4 && !N::kIsFixed ? -1e-4 : -1e-6));
  // What the port really gave: the correction is a tick late.
  CHECK(on.port_minimum_mj < -1e-3);
  CHECK(on.port_minimum_mj > -10);
  MESSAGE(std::string(N::kName) << ": booked " << on.lowest_account_mj / 1000 << " J, port minimum "
                                << on.port_minimum_mj << " mJ, farthest " << on.farthest_mm()
                                << " mm, swing " << on.swing_mm() << " mm, peak " << on.peak_n
                                << " N");
}

TEST_CASE_TEMPLATE("with the controller, its bound off, no cell of a sweep books energy", N,
                   FixedNumbers, DoubleNumbers) {
  constexpr double kBoundOffKg = 10;  // no mass of a device: 10 kN s/m at 1 kHz
  double booked_mj = 0, port_mj = 0, off_mj = 0;
  for (const double stiffness : {0.5, 2.0, 8.0, 20.0}) {
    for (const double rate_hz : {500.0, 1000.0, 4000.0}) {
      for (const double quantum_mm : {0.0, 0.02, 0.055}) {
        for (const double mass_kg : {0.045, 0.145}) {
          PortLoop loop{.mass_kg = mass_kg, .start_mm = 0.1};
          loop.stiffness_n_per_mm = stiffness;
          loop.rate_hz = rate_hz;
          loop.quantum_mm = quantum_mm;
          loop.seconds = 1;
          CAPTURE(stiffness);
          CAPTURE(rate_hz);
          CAPTURE(quantum_mm);
          CAPTURE(mass_kg);
          off_mj = std::min(off_mj, run_port_loop<N>(loop, NoStabiliser<N>{}).port_minimum_mj);
          const PortLoopRun on =
              run_port_loop<N>(loop, law<PassivityController, N>(kBoundOffKg, rate_hz));
          CHECK(on.lowest_account_mj >= -1e-6);
          CHECK(on.farthest_mm() < 6);
          booked_mj = std::min(booked_mj, on.lowest_account_mj);
          port_mj = std::min(port_mj, on.port_minimum_mj);
        }
      }
    }
  }
  CHECK(off_mj < -10);
  CHECK(port_mj > -50);
  MESSAGE(std::string(N::kName) << ": booked " << booked_mj << " mJ, port " << port_mj
                                << " mJ, off " << off_mj << " mJ");
}

TEST_CASE_TEMPLATE("energy bounding leaves a passive wall as it is, to the last bit", N,
                   FixedNumbers, DoubleNumbers) {
  PortLoop soft = kHardWall;
  soft.stiffness_n_per_mm = 0.2;  // half of 2 b / T
  const PortLoopRun off = run_port_loop<N>(soft, NoStabiliser<N>{});
  CHECK(run_port_loop<N>(soft, law<EnergyBounding, N>(0.0002)).force_n == off.force_n);
}

TEST_CASE_TEMPLATE("energy bounding never gives more than hand and device put in", N, FixedNumbers,
                   DoubleNumbers) {
  for (const double stiffness : {0.4, 1.0, 4.0, 20.0}) {
    for (const bool limits : {false, true}) {
      CAPTURE(stiffness);
      CAPTURE(limits);
      PortLoop loop = kHardWall;
      loop.stiffness_n_per_mm = stiffness;
      loop.limits = limits;
      const PortLoopRun on = run_port_loop<N>(loop, law<EnergyBounding, N>(0.0002));
      CHECK(on.least_total_mj > -2e-3);
      CHECK(on.farthest_mm() < 8);
      CHECK(on.peak_n < 3.3);
    }
  }
  const PortLoopRun off = run_port_loop<N>(kHardWall, NoStabiliser<N>{});
  CHECK(off.least_total_mj < -100);
}

TEST_CASE_TEMPLATE("at the ends of every range passivity only brakes, and within its bound", N,
                   FixedNumbers, DoubleNumbers) {
  for (const double mass_kg : {0.001, 0.045, 10.0}) {
    for (const double rate_hz : {250.0, 8000.0}) {
      CAPTURE(mass_kg);
      CAPTURE(rate_hz);
      const double most_n_per_mm =
          std::min(mass_kg * rate_hz * rate_hz / 1000, N::kIsFixed ? 32768.0 : 1e9);
      int acted = 0, wrong = 0;
      feed_extremes<N>(
          law<PassivityController, N>(mass_kg, rate_hz),
          [&](const StabiliserInput<N>& in, DeviceVec<typename N::Real> out, const auto& state) {
            if (out == in.wanted_n) return;
            ++acted;
            const auto to = doubles(out), from = doubles(in.wanted_n),
                       way = doubles(state.motion_mm);
            double work = 0, square = 0;
            for (std::size_t i = 0; i < 3; ++i) {
              wrong += std::isfinite(to[i]) ? 0 : 1;
              work += (to[i] - from[i]) * way[i];
              square += way[i] * way[i];
            }
            const double slack = 1e-4 + 1e-5 * vec3::length(from) * std::sqrt(square);
            wrong += work <= slack ? 0 : 1;
            const bool saturated = vec3::length(to) > 30'000 || vec3::length(from) > 30'000;
            if (N::kIsFixed && saturated) return;
            wrong +=
                -work <= most_n_per_mm * square * 1.001 + slack + 1e-3 * std::sqrt(square) ? 0 : 1;
          });
      CHECK(acted > 1000);
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE_TEMPLATE("at the ends of every range energy bounding only shortens the force", N,
                   FixedNumbers, DoubleNumbers) {
  for (const double damping : {1e-6, 0.0002, 0.1}) {
    for (const double rate_hz : {250.0, 8000.0}) {
      CAPTURE(damping);
      CAPTURE(rate_hz);
      int acted = 0, wrong = 0;
      feed_extremes<N>(
          law<EnergyBounding, N>(damping, rate_hz),
          [&](const StabiliserInput<N>& in, DeviceVec<typename N::Real> out, const auto& state) {
            const double to_n = vec3::length(doubles(out)),
                         from_n = vec3::length(doubles(in.wanted_n));
            wrong += std::isfinite(to_n) && to_n <= from_n * 1.0001 + 1e-9 ? 0 : 1;
            if (!(state.budget_mj > 0)) wrong += to_n == 0 ? 0 : 1;
            acted += out == in.wanted_n ? 0 : 1;
          });
      CHECK(acted > 1000);
      CHECK(wrong == 0);
    }
  }
}

}  // namespace kerf::stabiliser_test
