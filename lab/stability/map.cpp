// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/map.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numbers>
#include <utility>

#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/stability/gain_limits.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/plant_params.hpp"
#include "hil/hil_error.hpp"
#include "lab/run/grid_run.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/limit_cycle.hpp"
#include "lab/stability/one_axis.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

/// All cells of one column, each measured once.
class ColumnRun {
 public:
  ColumnRun(const MapSpec& spec, const LoopCase& subject, StepCounter& ticks)
      : spec_(spec), subject_(subject), ticks_(ticks) {
    if (spec.arm) scene_ = walls_scene(subject);
  }

  const LimitCycle& at(double stiffness) {
    const auto [place, is_new] = known_.try_emplace(stiffness);
    if (is_new) place->second = measure(stiffness);
    return place->second;
  }

  StabilityBoundary crossing(bool LimitCycle::*rule) {
    const std::vector<double>& grid = spec_.stiffness_n_per_mm;
    const auto bad = [&](double stiffness) { return at(stiffness).*rule; };
    StabilityBoundary found;
    std::size_t first = 0;
    while (first < grid.size() && !bad(grid[first])) ++first;
    if (first == grid.size()) return found;
    for (std::size_t i = first; i < grid.size(); ++i) {
      if (bad(grid[i])) {
        if (found.re_entry_from_n_per_mm > 0) break;
        continue;
      }
      if (found.re_entry_from_n_per_mm == 0) found.re_entry_from_n_per_mm = grid[i];
      found.re_entry_to_n_per_mm = grid[i];
    }
    found.first_n_per_mm = 0;
    if (first == 0) return found;
    double low = grid[first - 1], high = grid[first];
    constexpr double kClose = 1.005;
    while (high > low * kClose) {
      const double middle = std::sqrt(low * high);
      (bad(middle) ? high : low) = middle;
    }
    found.first_n_per_mm = low;
    return found;
  }

 private:
  /// Until one hit has shown the worst by both rules. The same places in all columns, so that two
  /// columns differ by their values alone, whatever else the map has.
  LimitCycle measure(double stiffness) {
    const double seconds = std::max(spec_.seconds, needed_seconds(subject_, stiffness));
    if (spec_.arm) {
      return hit_with_arm(scene_, subject_, stiffness, seconds, spec_.seed, ticks_);
    }
    LimitCycle worst;
    for (std::size_t hit = 0; hit < kHitsMmPerS.size(); ++hit) {
      const std::uint64_t seed = spec_.seed == 0 ? 0 : (spec_.seed << 32) + hit;
      worst.join(hit_one_axis(subject_, stiffness, kHitsMmPerS[hit], seconds, seed, ticks_));
      if (worst.swings && worst.active) break;
    }
    return worst;
  }

  const MapSpec& spec_;
  LoopCase subject_;
  StepCounter& ticks_;
  LoadedScene scene_;  ///< of the whole arm
  std::map<double, LimitCycle> known_;
};

constexpr double kLongestS = 600;  // of a hit: a column of one axis is then some minutes

}  // namespace

double needed_seconds(const LoopCase& subject, double stiffness_n_per_mm) {
  const SampledLoop& loop = subject.loop;
  const double mass_kg = loop.mass_kg + loop.hand.mass_kg;
  const double n_per_m = 1000 * (stiffness_n_per_mm + loop.hand.stiffness_n_per_mm);
  const double period_s = 2 * std::numbers::pi * std::sqrt(mass_kg / n_per_m);
  const double ns_per_m =
      1000 * (loop.viscous_ns_per_mm + subject.damping_ns_per_mm + loop.hand.damping_ns_per_mm);
  constexpr double kPeriods = 2;  // of a third: its travel is then from peak to peak
  constexpr double kOfDecay = 0.01;
  const double rate_per_s = ns_per_m / (2 * mass_kg);
  const double slow_s =
      rate_per_s > 0 ? -std::log(LimitCycleDetector::kGoesOn) / (kOfDecay * rate_per_s) : 0;
  // Let go with the most force for all of the delay, the tip flies until the push has taken the
  // same impulse back.
  const double delay_s = subject.loop.delay_s + subject.loop.period_s;
  const double flight_s = 2 * LimitSettings().force_n * delay_s / subject.push_n;
  return 3 * std::max(kPeriods * (period_s + flight_s), slow_s);
}

std::string impossible(const MapSpec& spec, const LoopCase& subject) {
  const double cycles = subject.loop.delay_s * kCyclesPerSecond;
  constexpr double kRounding = 1e-6;
  const bool ticks_fit = kCyclesPerSecond % std::lround(1 / subject.loop.period_s) == 0;
  if (spec.arm && ticks_fit &&
      (cycles > kMaxDelayCycles || std::abs(cycles - std::round(cycles)) > kRounding)) {
    return format("delay %g ms: an emulated device has whole steps of 0.125 ms, up to 8 ms",
                  subject.loop.delay_s * 1000);
  }
  if (spec.arm && !ticks_fit) {
    return format("rate %g Hz: an emulated device has rates that divide 8000 Hz, such as 4000",
                  1 / subject.loop.period_s);
  }
  const double rate_hz = 1 / subject.loop.period_s;
  const bool is_usb = subject.device != Personality::omni;
  if (spec.arm && is_usb && kUsbFramesPerSecond % std::lround(rate_hz) != 0) {
    return format("rate %g Hz: a USB device has rates that divide 1000 Hz, its frames, such as 500",
                  rate_hz);
  }
  const double needed_s = needed_seconds(subject, spec.stiffness_n_per_mm.front());
  if (needed_s > kLongestS) {
    return format(
        "mass %g kg: a hit would last %.3g s, above %g, to show whether its swings die out",
        subject.loop.mass_kg, needed_s, kLongestS);
  }
  const double most = highest_damping(subject.loop);
  if (subject.damping_ns_per_mm <= most) return {};
  return format("damping %g N s/mm is above %.4g, the most that is stable without a wall",
                subject.damping_ns_per_mm, most);
}

Column measure_column(const MapSpec& spec, const Assignment& values, StepCounter& ticks) {
  const LoopCase subject = subject_of(values);
  Column column;
  if (!impossible(spec, subject).empty()) return column;
  try {
    ColumnRun run(spec, subject, ticks);
    for (const double stiffness : spec.stiffness_n_per_mm) {
      column.cells.push_back(run.at(stiffness));
    }
    column.swing = run.crossing(&LimitCycle::swings);
    column.energy = run.crossing(&LimitCycle::active);
  } catch (const NotMet&) {
    return {};
  } catch (const LawError& error) {
    throw HilError("--law: " + subject.force_law.name + error.what());
  }
  return column;
}

void measure_columns(const MapSpec& spec, const std::vector<std::size_t>& wanted, std::size_t jobs,
                     const std::atomic<bool>& stop, const ColumnDone& done) {
  const std::vector<Assignment> columns = spec.columns();
  grid::Run run(jobs, &stop);
  TickWatch watch(run.results());
  run.all(wanted.size(), [&](std::size_t i, std::size_t) {
    const Assignment& values = columns[wanted[i]];
    StepCounter ticks(run.stop());
    const TickWatch::Watched watched(watch, ticks, laws_of(values));
    Column column = measure_column(spec, values, ticks);
    const std::scoped_lock hold(run.results());
    done(wanted[i], std::move(column), ticks.ticks());
  });
}

}  // namespace kerf::zwidth
