// SPDX-License-Identifier: Apache-2.0
#include "lab/energy/stabiliser_feel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "controller/law/energy_bounding.hpp"
#include "controller/law/passivity_controller.hpp"
#include "lab/rig/port_loop.hpp"

namespace kerf::energy {
namespace {

using N = FixedNumbers;

template <class Law>
Law law(double value) {
  const std::array values{value};
  return Law(LawSetup(1000, 0, Law::kSettings, values));
}

Feel feel_of(const PortLoop& loop, const PortLoopRun& run) {
  Feel feel{.stiffness_n_per_mm = loop.stiffness_n_per_mm,
            .peak_n = run.peak_n,
            .delay_ms = 3000,
            .port_minimum_mj = run.port_minimum_mj};
  const auto touch = std::ranges::find_if(run.at_mm, [](double y) { return y < 0; });
  const auto first = static_cast<std::size_t>(touch - run.at_mm.begin());
  const auto let_go = static_cast<std::size_t>(loop.let_go_s * loop.rate_hz);
  double low_mm = 1e9, high_mm = -1e9;
  for (std::size_t i = first; i < run.at_mm.size(); ++i) {
    if (run.force_n[i] >= loop.push_n / 2) {
      feel.delay_ms = std::min(feel.delay_ms, 1000 * static_cast<double>(i - first) / loop.rate_hz);
    }
    if (i >= let_go && run.at_mm[i] > 0.06) {  // an encoder's step is no contact any more
      feel.air_n = std::max(feel.air_n, std::abs(run.force_n[i]));
    }
    if (i < let_go * 3 / 4 || i >= let_go) continue;
    low_mm = std::min(low_mm, run.at_mm[i]);
    high_mm = std::max(high_mm, run.at_mm[i]);
    feel.depth_mm -= run.at_mm[i] / static_cast<double>(let_go - let_go * 3 / 4);
  }
  feel.swing_mm = high_mm - low_mm;
  return feel;
}

}  // namespace

std::vector<Feel> stabiliser_feel() {
  struct Hand {
    const char* name;
    double mass_kg, damping_ns_per_m;
  };
  // The device alone, and with a hand that grips it; both stabilisers only know the device.
  constexpr std::array kHands{Hand{"bare", 0.045, 0.2}, Hand{"gripped", 0.145, 3.2}};
  std::vector<Feel> all;
  for (const Hand& hand : kHands) {
    for (const double stiffness : {0.2, 0.4, 1.0, 2.0, 4.0, 10.0}) {
      const PortLoop loop{.mass_kg = hand.mass_kg,
                          .damping_ns_per_m = hand.damping_ns_per_m,
                          .let_go_s = 2,
                          .start_mm = 0.1,
                          .stiffness_n_per_mm = stiffness,
                          .quantum_mm = 0.055,
                          .limits = true};
      const auto add = [&](const char* name, const auto& stabiliser) {
        Feel feel = feel_of(loop, run_port_loop<N>(loop, stabiliser));
        feel.hand = hand.name;
        feel.stabiliser = name;
        all.push_back(feel);
      };
      add("none", NoStabiliser<N>{});
      add("passivity", law<PassivityController<N>>(0.045));
      add("energy_bounding", law<EnergyBounding<N>>(0.0002));
    }
  }
  return all;
}

}  // namespace kerf::energy
