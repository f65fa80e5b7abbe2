// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/map/map.hpp"

#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/stability/stable_gains.hpp"
#include "hil/devmodel/bus_cycle.hpp"
#include "hil/devmodel/plant_params.hpp"
#include "hil/hil_error.hpp"
#include "lab/zwidth/map/arm.hpp"
#include "lab/zwidth/map/one_axis.hpp"
#include "shared/text/format.hpp"

namespace kerf::zwidth {
namespace {

/// All cells of one column, each measured once.
class ColumnRun {
 public:
  ColumnRun(const MapSpec& spec, const Subject& subject, std::size_t index)
      : spec_(spec), subject_(subject), index_(index) {
    if (spec.arm) scene_ = walls_scene(subject);
  }

  const Swing& at(double stiffness) {
    const auto [place, is_new] = known_.try_emplace(stiffness);
    if (is_new) place->second = measure(stiffness);
    return place->second;
  }

  Crossing crossing(bool Swing::*rule) {
    const std::vector<double>& grid = spec_.stiffness_n_per_mm;
    const auto bad = [&](double stiffness) { return at(stiffness).*rule; };
    Crossing found;
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

  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }

 private:
  /// Until one hit has shown the worst by both rules.
  Swing measure(double stiffness) {
    if (spec_.arm) {
      const std::uint64_t seed = spec_.seed == 0 ? 0 : spec_.seed + index_;
      return hit_with_arm(scene_, subject_, stiffness, spec_.seconds, seed, ticks_);
    }
    Swing worst;
    for (std::size_t hit = 0; hit < kHitsMmPerS.size(); ++hit) {
      const std::uint64_t seed =
          spec_.seed == 0 ? 0 : (spec_.seed << 32) + index_ * kHitsMmPerS.size() + hit;
      worst.join(hit_one_axis(subject_, stiffness, kHitsMmPerS[hit], spec_.seconds, seed, ticks_));
      if (worst.swings && worst.active) break;
    }
    return worst;
  }

  const MapSpec& spec_;
  Subject subject_;
  std::size_t index_;
  LoadedScene scene_;  ///< of the whole arm
  std::map<double, Swing> known_;
  std::uint64_t ticks_ = 0;
};

}  // namespace

std::string impossible(const MapSpec& spec, const Subject& subject) {
  const double cycles = subject.loop.delay_s * kCyclesPerSecond;
  constexpr double kRounding = 1e-6;
  const bool ticks_fit = kCyclesPerSecond % std::lround(1 / subject.loop.period_s) == 0;
  if (spec.arm && ticks_fit &&
      (cycles > kMaxDelayCycles || std::abs(cycles - std::round(cycles)) > kRounding)) {
    return format("delay %g ms: an emulated device has whole steps of 0.125 ms, up to 8 ms",
                  subject.loop.delay_s * 1000);
  }
  const double most = highest_damping(subject.loop);
  if (subject.damping_ns_per_mm <= most) return {};
  return format("damping %g N s/mm is above %.4g, the most that is stable without a wall",
                subject.damping_ns_per_mm, most);
}

Column measure_column(const MapSpec& spec, const Assignment& values, std::size_t index) {
  const Subject subject = subject_of(values);
  Column column;
  if (!impossible(spec, subject).empty()) return column;
  try {
    ColumnRun run(spec, subject, index);
    for (const double stiffness : spec.stiffness_n_per_mm) {
      column.cells.push_back(run.at(stiffness));
    }
    column.swing = run.crossing(&Swing::swings);
    column.energy = run.crossing(&Swing::active);
    column.ticks = run.ticks();
  } catch (const NotMet&) {
    return {};
  } catch (const LawError& error) {
    throw HilError("--law: " + subject.force_law.name + error.what());
  }
  return column;
}

void measure_columns(const MapSpec& spec, const std::vector<std::size_t>& wanted, int jobs,
                     const std::function<bool(std::size_t index, Column column)>& done) {
  const std::vector<Assignment> columns = spec.columns();
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex lock;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < wanted.size() && !stop; i = next++) {
        Column column = measure_column(spec, columns[wanted[i]], wanted[i]);
        const std::scoped_lock hold(lock);
        if (!done(wanted[i], std::move(column))) stop = true;
      }
    } catch (...) {
      const std::scoped_lock hold(lock);
      failure = std::current_exception();
      stop = true;
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 1; i < jobs; ++i) threads.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace kerf::zwidth
