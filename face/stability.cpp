// SPDX-License-Identifier: Apache-2.0
#include "kerf/stability.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <thread>
#include <utility>

#include "controller/stability/identified_loop.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "face/loaded.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/device_file.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/one_axis.hpp"
#include "shared/device/identified_device.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {
namespace {

/// `name` is within these limits, both allowed; NaN is not.
void require_within(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return;
  throw Error(std::string(name) + " = " + number_text(value) + ": give one from " +
              number_text(least) + " to " + number_text(most));
}

/// The limits of the options of `kerf lab zwidth`.
void require_sound(const WallRun& run) {
  if (const std::string problem = problem_in(run.loop); !problem.empty()) throw Error(problem);
  require_within("period_s", run.loop.period_s, 1.0 / 32000, 1.0 / 250);
  require_within("mass_kg", run.loop.mass_kg, 0.001, 100);
  require_within("stiffness_n_per_mm", run.stiffness_n_per_mm, 1e-4, 127);
  require_within("damping_ns_per_mm", run.damping_ns_per_mm, 0, 2);
  require_within("push_n", run.push_n, 0, 100);
  require_within("hit_mm_per_s", run.hit_mm_per_s, 0, 10'000);
  require_within("start_mm", run.start_mm, 0, 10);
  require_within("seconds", run.seconds, 0.001, zwidth::kLongestLimitS);
}

zwidth::LoopCase case_of(const WallRun& run) {
  using zwidth::Law;
  zwidth::LoopCase subject;
  subject.loop = run.loop;
  subject.damping_ns_per_mm = run.damping_ns_per_mm;
  subject.estimator.name = run.estimator;
  subject.numeric = run.fixed_point ? NumericKind::fixed : NumericKind::float64;
  subject.limits = run.limits;
  if (run.law == "coupling") {
    subject.law = Law::coupling;
  } else if (run.law == "linear") {
    subject.law = Law::linear;
  } else if (run.law == "two_sided") {
    subject.law = Law::two_sided;
  } else {
    subject.law = Law::own;
    subject.force_law.name = run.law;
  }
  return subject;
}

constexpr std::size_t kDevice = static_cast<std::size_t>(zwidth::AxisId::device);

bool is_file(std::string_view device) {
  return device.ends_with(".toml");
}

/// Puts the axes of a device that is a file in the place of its name.
void take_file(const std::string& direction, std::array<std::string, zwidth::kAxisCount>& texts,
               std::array<bool, zwidth::kAxisCount>& given) {
  const std::string device = texts[kDevice];
  if (!is_file(device) || device.find(',') != std::string::npos) {
    if (device.find(".toml") != std::string::npos) {
      throw Error("device: " + one_line(device) + ": give one file alone");
    }
    if (direction.empty()) return;
    throw Error("direction: " + one_line(direction) +
                ": is that of a file as the device; give such as device.toml, or leave it out");
  }
  static_cast<void>(zwidth::take_device(device, direction.empty() ? "worst" : direction, texts));
  given[kDevice] = false;
  for (std::size_t number = 0; number < texts.size(); ++number) {
    if (number != kDevice && !texts[number].empty()) given[number] = true;
  }
}

zwidth::MapSpec spec_of(std::string_view stiffness, const std::vector<MapAxis>& axes,
                        const MapOptions& options) {
  require_within("seconds", options.seconds, 0.001, zwidth::kLongestLimitS);
  require_within("seeds", static_cast<double>(options.seeds), 1, zwidth::kMostSeeds);
  zwidth::MapSpec spec;
  spec.stiffness_n_per_mm = zwidth::stiffness_values(std::string(stiffness));
  spec.seconds = options.seconds;
  spec.seed = options.seed;
  spec.seeds = options.seeds;
  std::array<std::string, zwidth::kAxisCount> texts;
  std::array<bool, zwidth::kAxisCount> given{};
  for (const MapAxis& axis : axes) {
    const std::size_t number = zwidth::axis_named("axis", axis.name);
    if (number == zwidth::kAxisCount) throw Error("axis stiffness: it is the first argument");
    if (given[number]) throw Error("axis " + axis.name + ": given twice");
    given[number] = true;
    texts[number] = axis.values;
  }
  take_file(options.direction, texts, given);
  for (std::size_t number = 0; number < texts.size(); ++number) {
    if (!given[number]) continue;
    spec.table[number] = zwidth::axis_values(static_cast<zwidth::AxisId>(number), texts[number]);
  }
  return spec;
}

}  // namespace

std::string problem_in(const SampledLoop& loop) {
  const std::pair<const char*, double> positive[] = {{"mass_kg", loop.mass_kg},
                                                     {"period_s", loop.period_s}};
  const std::pair<const char*, double> not_negative[] = {
      {"viscous_ns_per_mm", loop.viscous_ns_per_mm},
      {"delay_s", loop.delay_s},
      {"velocity_filter_s", loop.velocity_filter_s},
      {"hand.mass_kg", loop.hand.mass_kg},
      {"hand.damping_ns_per_mm", loop.hand.damping_ns_per_mm},
      {"hand.stiffness_n_per_mm", loop.hand.stiffness_n_per_mm},
      {"coulomb_n", loop.coulomb_n},
      {"quantum_mm", loop.quantum_mm}};
  for (const auto& [name, value] : positive) {
    if (std::isfinite(value) && value > 0) continue;
    return std::string(name) + " = " + number_text(value) + ": give a positive one";
  }
  for (const auto& [name, value] : not_negative) {
    if (std::isfinite(value) && value >= 0) continue;
    return std::string(name) + " = " + number_text(value) + ": give 0 or a positive one";
  }
  return {};
}

SampledLoop device_loop(std::string_view device, double rate_hz, std::string_view direction) {
  require_within("rate_hz", rate_hz, 1, 1e6);
  if (is_file(device)) {
    constexpr double kDamping = 0.002;  // of which the worst direction is taken
    return or_error([&] {
      const IdentifiedDevice found = read_identified_device(device);
      const std::string text(direction.empty() ? "worst" : direction);
      const DeviceDirection along = zwidth::direction_of(found, text, kDamping, rate_hz);
      return loop_along(found, along, rate_hz, false);
    });
  }
  const auto personality = personality_of(device);
  if (!personality) {
    throw Error("device: " + one_line(device) + unknown_word(device, kPersonalityWords));
  }
  return unheld_loop(*personality, rate_hz);
}

LimitCycle run_on_wall(const WallRun& run) {
  return run_on_wall(run, {});
}

LimitCycle run_on_wall(const WallRun& run, const WallWatch& watch) {
  std::exception_ptr of_watch;
  zwidth::SwingWatch shown;
  if (watch) {
    shown = [&](const zwidth::SwingTick& tick) {
      try {
        watch(tick.tip_mm, tick.mm_per_s);
      } catch (...) {
        of_watch = std::current_exception();
        throw Interrupted();
      }
    };
  }
  const LimitCycle seen = or_error([&] {
    require_sound(run);
    zwidth::StepCounter ticks;
    try {
      return zwidth::hit_one_axis(case_of(run), run.stiffness_n_per_mm,
                                  {run.push_n, run.hit_mm_per_s, run.start_mm}, run.seconds,
                                  run.seed, ticks, shown);
    } catch (const Interrupted&) {
      return LimitCycle{};
    } catch (const LawError& error) {
      throw Error("law " + one_line(run.law) + " (or coupling, linear, two_sided), estimator " +
                  one_line(run.estimator) + ":" + error.what());
    }
  });
  if (of_watch) std::rethrow_exception(of_watch);
  return seen;
}

SampledLoop column_loop(const std::vector<MapAxis>& axes, std::string_view direction) {
  return or_error([&] {
    const std::vector<zwidth::Assignment> all =
        spec_of("1", axes, {.direction = std::string(direction)}).columns();
    if (all.size() != 1) {
      throw Error("axes: " + std::to_string(all.size()) + " columns; give each axis one value");
    }
    return zwidth::subject_of(all.front()).loop;
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
        const std::size_t number = zwidth::axis_named("axis", axis.name);
        const bool named = number == kDevice && is_file(axis.values);
        column.values.push_back(named ? axis.values : all[i][number]);
      }
      column.impossible = zwidth::impossible(spec, zwidth::subject_of(all[i]));
      if (column.impossible.empty()) wanted.push_back(i);
    }
    const std::size_t threads = options.threads > 0
                                    ? options.threads
                                    : std::max<std::size_t>(1, std::thread::hardware_concurrency());
    const std::atomic<bool> never{false};
    zwidth::measure_columns(
        spec, wanted, threads, options.stop != nullptr ? *options.stop : never,
        [&](std::size_t i, zwidth::Column measured, std::uint64_t) {
          MapColumn& column = map.columns[i];
          column.first_swing_n_per_mm = measured.swing.first_n_per_mm;
          column.first_energy_n_per_mm = measured.energy.first_n_per_mm;
          column.swing_by_seed_n_per_mm = std::move(measured.swing.by_seed_n_per_mm);
          column.energy_by_seed_n_per_mm = std::move(measured.energy.by_seed_n_per_mm);
          column.cells = std::move(measured.cells);
        });
    return map;
  });
}

}  // namespace kerf
