// SPDX-License-Identifier: Apache-2.0
#include "lab/impedance/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "controller/stability/sampled_loop.hpp"
#include "lab/stability/map_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::impedance {
namespace {

using zwidth::AxisId;

Json felt(std::optional<Impedance> z, double hz) {
  if (!z) return nullptr;
  return {{"stiffness_n_per_mm", felt_stiffness(*z, hz)}, {"damping_ns_per_mm", z->real()}};
}

Json least_json(const LeastDamping& least) {
  return {{"hz", least.hz}, {"damping_ns_per_mm", least.ns_per_mm}};
}

std::string least_line(const char* of, const LeastDamping& least) {
  return format("%s: least damping %.4g N s/mm, at %.4g Hz\n", of, least.ns_per_mm, least.hz);
}

}  // namespace

Impedance Spectrum::wall_by_theory(const SineResult& row) const {
  return wall_impedance(subject.loop, stiffness_n_per_mm, subject.damping_ns_per_mm, row.hz);
}

Impedance Spectrum::port_by_theory(const SineResult& row) const {
  return wall_by_theory(row) + device_impedance(subject.loop, row.hz, row.amplitude_mm);
}

std::optional<Impedance> Spectrum::port_measured(const SineResult& row) const {
  if (row.port || !row.wall) return row.port;
  return *row.wall + device_impedance(subject.loop, row.hz, row.amplitude_mm);
}

bool Spectrum::theory_holds() const {
  const bool is_linear = subject.law == zwidth::Law::coupling ||
                         subject.law == zwidth::Law::linear ||
                         subject.law == zwidth::Law::two_sided;
  return is_linear && subject.estimator.name == "difference" && subject.stabiliser.name.empty();
}

LeastDamping Spectrum::least_damping(bool port) const {
  const double from_hz = 1, to_hz = 1 / subject.loop.period_s / 4;
  // The delay turns the force by a wave in 1/td: twenty points each, and 200 by ratio below.
  const double waves = to_hz * subject.loop.delay_s;
  const int points = 200 + static_cast<int>(20 * waves);
  LeastDamping least{0, std::numeric_limits<double>::infinity()};
  const auto try_at = [&](double hz) {
    const double own = port ? subject.loop.viscous_ns_per_mm : 0;
    const double ns_per_mm =
        own +
        wall_impedance(subject.loop, stiffness_n_per_mm, subject.damping_ns_per_mm, hz).real();
    if (ns_per_mm < least.ns_per_mm) least = {hz, ns_per_mm};
  };
  for (int i = 0; i <= points; ++i) {
    const double part = static_cast<double>(i) / points;
    try_at(from_hz * std::pow(to_hz / from_hz, part));
    try_at(from_hz + (to_hz - from_hz) * part);
  }
  return least;
}

Deviation deviation(Impedance measured, Impedance theory) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  return {std::abs(measured / theory) - 1, std::arg(measured / theory) * kDegrees};
}

std::string text_of(const Spectrum& spectrum) {
  const zwidth::LoopCase& subject = spectrum.subject;
  std::string text =
      format("K %g N/mm, B %g N s/mm at %g Hz, delay %g ms; %s\n", spectrum.stiffness_n_per_mm,
             subject.damping_ns_per_mm, 1 / subject.loop.period_s, 1000 * subject.loop.delay_s,
             zwidth::laws_of(spectrum.values).c_str());
  text += format("%-8s %20s %20s %17s %21s\n", "motion", "wall, theory", "wall, measured", "off",
                 "device and wall");
  text += format("%-8s %10s%10s %10s%10s %9s%8s %11s%10s\n", "Hz", "K N/mm", "B N s/mm", "K N/mm",
                 "B N s/mm", "%", "deg", "K N/mm", "B N s/mm");
  Deviation most;
  for (const SineResult& row : spectrum.rows) {
    const Impedance theory = spectrum.wall_by_theory(row);
    text += format("%-8.4g %10.4g%10.3g ", row.hz, felt_stiffness(theory, row.hz), theory.real());
    if (row.wall) {
      const Deviation off = deviation(*row.wall, theory);
      most.ratio = std::max(most.ratio, std::abs(off.ratio));
      most.deg = std::max(most.deg, std::abs(off.deg));
      text += format("%10.4g%10.3g %9.2f%8.2f", felt_stiffness(*row.wall, row.hz), row.wall->real(),
                     100 * off.ratio, off.deg);
      const Impedance port = *spectrum.port_measured(row);
      text += format(" %11.4g%10.3g\n", felt_stiffness(port, row.hz), port.real());
    } else {  // Coulomb friction depends on a motion that there is not
      text += format("%38s %11s%10s\n", spectrum.unmeasured.c_str(), "-", "-");
    }
  }
  text += format("furthest from theory: %.2f %%, %.2f deg", 100 * most.ratio, most.deg);
  text += spectrum.theory_holds() ? "\n"
                                  : "; that is of the estimator difference, without stabiliser\n";
  text += least_line("wall", spectrum.least_damping(false));
  text += least_line("device and wall, without Coulomb friction", spectrum.least_damping(true));
  const double needed =
      passive_viscosity(subject.loop, spectrum.stiffness_n_per_mm, subject.damping_ns_per_mm);
  return text +
         format("passive with any hand from a device damping of %.4g N s/mm on; it has %.4g\n",
                needed, subject.loop.viscous_ns_per_mm);
}

std::string json_of(const Spectrum& spectrum) {
  const zwidth::LoopCase& subject = spectrum.subject;
  Json json{
      {"version", KERF_VERSION},
      {"axes", zwidth::axes_json(spectrum.values)},
      {"stiffness_n_per_mm", spectrum.stiffness_n_per_mm},
      {"theory_holds", spectrum.theory_holds()},
      {"least_damping",
       {{"wall", least_json(spectrum.least_damping(false))},
        {"port", least_json(spectrum.least_damping(true))}}},
      {"passive_viscous_ns_per_mm",
       passive_viscosity(subject.loop, spectrum.stiffness_n_per_mm, subject.damping_ns_per_mm)}};
  for (const SineResult& row : spectrum.rows) {
    const Impedance theory = spectrum.wall_by_theory(row);
    json["rows"].push_back(
        {{"hz", row.hz},
         {"amplitude_mm", row.amplitude_mm},
         {"wall", {{"theory", felt(theory, row.hz)}, {"measured", felt(row.wall, row.hz)}}},
         {"port",
          {{"theory", felt(spectrum.port_by_theory(row), row.hz)},
           {"measured", felt(spectrum.port_measured(row), row.hz)}}}});
  }
  return json.document();
}

}  // namespace kerf::impedance
