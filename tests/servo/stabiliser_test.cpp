// SPDX-License-Identifier: Apache-2.0
// The stabilisers on the smallest loop that goes unstable.
#include <array>
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "controller/law/energy_bounding.hpp"
#include "controller/law/passivity_controller.hpp"
#include "lab/rig/port_loop.hpp"

using namespace kerf;

namespace {

template <template <class> class Law, class N>
Law<N> law(double value, double rate_hz = 1000) {
  const std::array values{value};
  return Law<N>(LawSetup(rate_hz, 0, Law<N>::kSettings, values));
}

/// S15: 0.1 kg and 0.2 N s/m against 20 N/mm, 50 times what it bears; a push of 1 N.
constexpr PortLoop kHardWall{};

}  // namespace

TEST_CASE_TEMPLATE(
    "S15: a wall far beyond the limit diverges, and is bounded by the passivity "
    "controller",
    N, FixedNumbers, FloatNumbers, DoubleNumbers) {
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

TEST_CASE_TEMPLATE("energy bounding leaves a passive wall as it is, to the last bit", N,
                   FixedNumbers, FloatNumbers, DoubleNumbers) {
  PortLoop soft = kHardWall;
  soft.stiffness_n_per_mm = 0.2;  // half of 2 b / T
  const PortLoopRun off = run_port_loop<N>(soft, NoStabiliser<N>{});
  CHECK(run_port_loop<N>(soft, law<EnergyBounding, N>(0.0002)).force_n == off.force_n);
}

TEST_CASE_TEMPLATE("energy bounding never gives more than hand and device put in", N, FixedNumbers,
                   FloatNumbers, DoubleNumbers) {
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
