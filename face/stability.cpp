// SPDX-License-Identifier: Apache-2.0
#include "kerf/stability.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>

#include "controller/stability/sampled_loop.hpp"
#include "face/loaded.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/one_axis.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {
namespace {

zwidth::LoopCase case_of(const WallRun& run) {
  using zwidth::Law;
  zwidth::LoopCase subject;
  subject.loop = run.loop;
  subject.damping_ns_per_mm = run.damping_ns_per_mm;
  subject.push_n = run.push_n;
  subject.estimator.name = run.estimator;
  subject.numeric = run.fixed_point ? NumericKind::fixed : NumericKind::float64;
  subject.limits = run.limits;
  if (run.law == "coupling" || run.law == "linear" || run.law == "two_sided") {
    subject.law = run.law == "coupling" ? Law::coupling
                  : run.law == "linear" ? Law::linear
                                        : Law::two_sided;
  } else {
    subject.law = Law::own;
    subject.force_law.name = run.law;
    static_cast<void>(find_law(LawKind::force, run.law));
  }
  return subject;
}

void require(bool met, const std::string& name, double value, const char* way_out) {
  if (met) return;
  throw Error(name + " = " + number_text(value) + ": " + way_out);
}

zwidth::MapSpec spec_of(std::string_view stiffness, const std::vector<MapAxis>& axes,
                        const MapOptions& options) {
  zwidth::MapSpec spec;
  spec.stiffness_n_per_mm = zwidth::stiffness_values(std::string(stiffness));
  spec.seconds = options.seconds;
  spec.seed = options.seed;
  spec.seeds = options.seeds;
  for (const MapAxis& axis : axes) {
    const std::size_t number = zwidth::axis_named("axis", axis.name);
    if (number == zwidth::kAxisCount) throw Error("axis stiffness: it is the first argument");
    spec.table[number] = zwidth::axis_values(static_cast<zwidth::AxisId>(number), axis.values);
  }
  return spec;
}

}  // namespace

SampledLoop device_loop(std::string_view device, double rate_hz) {
  const auto found = std::ranges::find(kPersonalityWords, device);
  if (found == kPersonalityWords.end()) {
    throw Error("device: " + one_line(device) + unknown_word(device, kPersonalityWords));
  }
  require(rate_hz > 0, "rate_hz", rate_hz, "give a positive one");
  return unheld_loop(static_cast<Personality>(found - kPersonalityWords.begin()), rate_hz);
}

LimitCycle run_on_wall(const WallRun& run) {
  return or_error([&] {
    require(run.loop.mass_kg > 0, "mass_kg", run.loop.mass_kg, "give a positive one");
    require(run.loop.period_s > 0, "period_s", run.loop.period_s, "give a positive one");
    require(run.seconds > 0 && run.seconds <= zwidth::kLongestLimitS, "seconds", run.seconds,
            "give one above 0, up to 600");
    zwidth::StepCounter ticks;
    return zwidth::hit_one_axis(case_of(run), run.stiffness_n_per_mm, run.hit_mm_per_s, run.seconds,
                                run.seed, ticks);
  });
}

StabilityMap stability_map(std::string_view stiffness, const std::vector<MapAxis>& axes,
                           const MapOptions& options) {
  return or_error([&] {
    const zwidth::MapSpec spec = spec_of(stiffness, axes, options);
    const std::vector<zwidth::Assignment> all = spec.columns();
    StabilityMap map{spec.stiffness_n_per_mm, std::vector<MapColumn>(all.size())};
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < all.size(); ++i) {
      MapColumn& column = map.columns[i];
      for (const MapAxis& axis : axes) {
        column.values.push_back(all[i][zwidth::axis_named("axis", axis.name)]);
      }
      column.impossible = zwidth::impossible(spec, zwidth::subject_of(all[i]));
      if (column.impossible.empty()) wanted.push_back(i);
    }
    const std::size_t threads = options.threads > 0
                                    ? options.threads
                                    : std::max<std::size_t>(1, std::thread::hardware_concurrency());
    const std::atomic<bool> stop{false};
    zwidth::measure_columns(spec, wanted, threads, stop,
                            [&](std::size_t i, zwidth::Column measured, std::uint64_t) {
                              MapColumn& column = map.columns[i];
                              column.first_swing_n_per_mm = measured.swing.first_n_per_mm;
                              column.first_energy_n_per_mm = measured.energy.first_n_per_mm;
                              column.cells = std::move(measured.cells);
                            });
    return map;
  });
}

}  // namespace kerf
