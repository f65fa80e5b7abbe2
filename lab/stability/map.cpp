// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/map.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <optional>
#include <utility>

#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/stability/limit_cycle.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/plant_params.hpp"
#include "hil/hil_error.hpp"
#include "lab/run/grid_run.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/map_file.hpp"
#include "lab/stability/one_axis.hpp"
#include "lab/stability/tick_watch.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

/// All cells of one column, each measured once.
class ColumnRun {
 public:
  ColumnRun(const MapSpec& spec, const LoopCase& subject, StepCounter& ticks)
      : spec_(spec),
        subject_(subject),
        ticks_(ticks),
        // The seed shifts the steps of the encoders.
        seeds_(spec.arm || subject.loop.quantum_mm > 0 ? spec.seeds : 1) {
    if (spec.arm) scene_ = walls_scene(subject);
  }

  LimitCycle cell(double stiffness) {
    LimitCycle worst;
    for (std::size_t i = 0; i < seeds_ && !worst.worst(); ++i) worst.join(at(stiffness, i));
    return worst;
  }

  StabilityBoundary crossing(bool LimitCycle::*rule, const std::vector<LimitCycle>& cells) {
    StabilityBoundary found;
    found.last_n_per_mm = 0;
    for (std::size_t i = 0; i < seeds_; ++i) {
      const double first = first_of(rule, i);
      found.by_seed_n_per_mm.push_back(first);
      found.first_n_per_mm = std::min(found.first_n_per_mm, first);
      found.last_n_per_mm = std::max(found.last_n_per_mm, first);
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const double stiffness = spec_.stiffness_n_per_mm[i];
      if (stiffness <= found.first_n_per_mm) continue;
      if (cells[i].*rule || cells[i].undecided) {
        if (found.re_entry_from_n_per_mm > 0) break;
        continue;
      }
      if (found.re_entry_from_n_per_mm == 0) found.re_entry_from_n_per_mm = stiffness;
      found.re_entry_to_n_per_mm = stiffness;
    }
    return found;
  }

  /// The lowest of all that have a verdict.
  [[nodiscard]] double undecided() const {
    for (const auto& [place, seen] : known_) {
      if (seen.undecided) return place.first;
    }
    return StabilityBoundary::kNever;
  }

 private:
  /// From the lowest stiffness up, in steps so fine that an island of swings between two cells of
  /// the map is found; then halved to 0.5 %. The whole arm, which is slower, has the map's steps.
  double first_of(bool LimitCycle::*rule, std::size_t seed) {
    constexpr double kFine = 1.01, kClose = 1.005;
    const auto bad = [&](double stiffness) { return at(stiffness, seed).*rule; };
    const std::vector<double>& grid = spec_.stiffness_n_per_mm;
    if (bad(grid.front())) return 0;
    for (std::size_t cell = 1; cell < grid.size(); ++cell) {
      const double ratio = grid[cell] / grid[cell - 1];
      const int parts = spec_.arm ? 1 : int(std::ceil(std::log(ratio) / std::log(kFine)));
      double low = grid[cell - 1];
      for (int part = 1; part <= parts; ++part) {
        double high =
            part == parts
                ? grid[cell]
                : seven_digits(grid[cell - 1] * std::pow(ratio, static_cast<double>(part) / parts));
        const bool is_cell = part == parts;
        if ((!is_cell && !(looked(high, seed).*rule)) || !bad(high)) {
          low = high;
          continue;
        }
        while (high > low * kClose) {
          const double middle = seven_digits(std::sqrt(low * high));
          (bad(middle) ? high : low) = middle;
        }
        return high;
      }
    }
    return StabilityBoundary::kNever;
  }

  const LimitCycle& at(double stiffness, std::size_t nth) {
    const auto [place, is_new] = known_.try_emplace({stiffness, nth});
    if (is_new) place->second = measured(stiffness, nth, 1);
    return place->second;
  }

  /// A first look between two cells, with a fifth of the limit: what swings there gets the verdict.
  const LimitCycle& looked(double stiffness, std::size_t nth) {
    constexpr double kPart = 0.2;
    const auto [place, is_new] = looked_.try_emplace({stiffness, nth});
    if (is_new) place->second = measured(stiffness, nth, kPart);
    return place->second;
  }

  /// All hits of a seed, until one has shown the worst by both rules. The same places in all
  /// columns, so that two columns differ by their values alone, whatever else the map has.
  LimitCycle measured(double stiffness, std::size_t nth, double part) {
    const std::uint64_t seed = spec_.seed + nth;
    const double limit_s = part * std::max(spec_.seconds, needed_seconds(subject_, stiffness));
    LimitCycle worst;
    for (std::size_t hit = 0; hit < (spec_.arm ? kArmHits : kHitsMmPerS.size()); ++hit) {
      const std::uint64_t place_of_hit = seed == 0 ? 0 : (seed << 32) + hit;
      worst.join(spec_.arm ? hit_with_arm(scene_, subject_, stiffness, hit, limit_s, seed, ticks_)
                           : hit_one_axis(subject_, stiffness, kHitsMmPerS[hit], limit_s,
                                          place_of_hit, ticks_));
      if (worst.worst()) break;
    }
    return is_arithmetic(worst, stiffness, limit_s)
               ? LimitCycle{.arithmetic = true,
                            .travel_mm = worst.travel_mm,
                            .given_mj = worst.given_mj,
                            .port_minimum_mj = worst.port_minimum_mj}
               : worst;
  }

  /// Whether a motion that does not rest is that of fixed numbers alone: without encoder steps, too
  /// small for any encoder, and at rest in double.
  bool is_arithmetic(const LimitCycle& fixed, double stiffness, double limit_s) {
    constexpr double kFinestStepMm = 1e-3;  // a tenth of the omega's (docs/devices.md)
    if (fixed.rests() || fixed.travel_mm > kFinestStepMm || spec_.arm ||
        subject_.numeric != NumericKind::fixed || subject_.loop.quantum_mm > 0) {
      return false;
    }
    LoopCase exact = subject_;
    exact.numeric = NumericKind::float64;
    return std::ranges::all_of(kHitsMmPerS, [&](double hit_mm_per_s) {
      return hit_one_axis(exact, stiffness, hit_mm_per_s, limit_s, 0, ticks_).rests();
    });
  }

  const MapSpec& spec_;
  LoopCase subject_;
  StepCounter& ticks_;
  std::size_t seeds_;
  LoadedScene scene_;                                                    ///< of the whole arm
  std::map<std::pair<double, std::size_t>, LimitCycle> known_, looked_;  ///< by stiffness and seed
};

}  // namespace

double needed_seconds(const LoopCase& subject, double stiffness_n_per_mm) {
  const SampledLoop& loop = subject.loop;
  const double mass_kg = loop.mass_kg + loop.hand.mass_kg;
  const double n_per_m = 1000 * (stiffness_n_per_mm + loop.hand.stiffness_n_per_mm);
  const double ns_per_m =
      1000 * (loop.viscous_ns_per_mm + subject.damping_ns_per_mm + loop.hand.damping_ns_per_mm);
  constexpr double kWindows = 16, kConstants = 12, kOfDecay = 0.01, kFall = 0.09;
  const bool creeps = ns_per_m * ns_per_m > 4 * mass_kg * n_per_m;
  return std::max({kWindows * slowest_swing_s(subject, stiffness_n_per_mm),
                   creeps ? kConstants * ns_per_m / n_per_m : 0,
                   ns_per_m > 0 ? kFall * 2 * mass_kg / (kOfDecay * ns_per_m) : 0});
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
  const bool is_usb = !kind_of(subject.device).streams;
  if (spec.arm && is_usb && kUsbFramesPerSecond % std::lround(rate_hz) != 0) {
    return format("rate %g Hz: a USB device has rates that divide 1000 Hz, its frames, such as 500",
                  rate_hz);
  }
  const double needed_s = needed_seconds(subject, spec.stiffness_n_per_mm.front());
  if (needed_s > kLongestLimitS) {
    return format(
        "mass %g kg, damping %g N s/mm: a hit would last %.3g s, above %g, to show whether its "
        "motion dies out",
        subject.loop.mass_kg, subject.loop.viscous_ns_per_mm, needed_s, kLongestLimitS);
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
      column.cells.push_back(run.cell(stiffness));
    }
    column.swing = run.crossing(&LimitCycle::swings, column.cells);
    column.energy = run.crossing(&LimitCycle::active, column.cells);
    column.undecided_n_per_mm = run.undecided();
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

namespace {

std::pair<double, double> cell_in(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto stiffness = number_in(text.substr(0, colon));
  const auto damping =
      colon == std::string::npos ? std::nullopt : number_in(text.substr(colon + 1));
  if (!stiffness || !damping || !(*stiffness >= 1e-4) || *stiffness > 127 || *damping < 0 ||
      *damping > 2) {
    throw HilError("--cells: " + text +
                   " is no cell; give stiffness:damping in N/mm and N s/mm, such as 2:0.002");
  }
  return {*stiffness, *damping};
}

using Curve = std::vector<SwingTick>;
using Curves = std::vector<Curve>;  // one for each hit

/// The curves without the points that lie within a thousandth of both axes of the last one kept: at
/// 32 kHz there are some hundred for each that is seen.
Json thinned(const Curves& curves) {
  double left = 0, right = 0, low = 0, high = 0;
  for (const Curve& curve : curves) {
    for (const SwingTick& tick : curve) {
      left = std::min(left, tick.tip_mm);
      right = std::max(right, tick.tip_mm);
      low = std::min(low, tick.mm_per_s);
      high = std::max(high, tick.mm_per_s);
    }
  }
  constexpr double kLeast = 1e-3;
  constexpr std::array<const char*, kArmHits> kHits{"push", "50 mm/s", "200 mm/s", "slide",
                                                    "corner"};
  Json hits = Json::List{};
  for (std::size_t h = 0; h < curves.size(); ++h) {
    Json tip = Json::List{}, speed = Json::List{};
    const SwingTick* kept = nullptr;
    for (const SwingTick& tick : curves[h]) {
      if (kept != nullptr && &tick != &curves[h].back() &&
          std::abs(tick.tip_mm - kept->tip_mm) <= kLeast * (right - left) &&
          std::abs(tick.mm_per_s - kept->mm_per_s) <= kLeast * (high - low)) {
        continue;
      }
      tip.push_back(tick.tip_mm);
      speed.push_back(tick.mm_per_s);
      kept = &tick;
    }
    hits.push_back(
        {{"name", kHits[h]}, {"tip_mm", std::move(tip)}, {"mm_per_s", std::move(speed)}});
  }
  return hits;
}

Curves curves_of(const MapSpec& spec, const LoopCase& subject, double stiffness,
                 StepCounter& ticks) {
  Curves curves(spec.arm ? kArmHits : kHitsMmPerS.size());
  const LoadedScene scene = spec.arm ? walls_scene(subject) : LoadedScene();
  for (std::size_t hit = 0; hit < curves.size(); ++hit) {
    const auto watch = [&curve = curves[hit]](const SwingTick& tick) { curve.push_back(tick); };
    static_cast<void>(spec.arm ? hit_with_arm(scene, subject, stiffness, hit, spec.seconds,
                                              spec.seed, ticks, watch)
                               : hit_one_axis(subject, stiffness, kHitsMmPerS[hit], spec.seconds,
                                              spec.seed, ticks, watch));
  }
  return curves;
}

}  // namespace

std::string portraits_of(const MapSpec& spec, const std::vector<std::string>& cells) {
  constexpr std::size_t kMost = 12;
  if (cells.empty() || cells.size() > kMost) {
    throw HilError("--portraits: give --cells, 1 to 12 of them, such as 2:0.002,20:0.002");
  }
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (spec.table[axis].size() < 2 || axis == index_of(AxisId::damping)) continue;
    throw HilError(std::string("--portraits: the axis ") + axis_kinds()[axis].name + " has " +
                   std::to_string(spec.table[axis].size()) + " values; give it one");
  }
  std::vector<std::pair<double, double>> places;
  LoopCase subject = subject_of(spec.columns().front());
  for (const std::string& cell : cells) {
    const auto place = cell_in(cell);
    if (std::ranges::find(places, place) != places.end()) {
      throw HilError("--cells: " + cell + " stands there twice; name each once");
    }
    subject.damping_ns_per_mm = place.second;
    const std::string why = impossible(spec, subject);
    if (!why.empty()) throw HilError("--cells: " + cell + ": " + why + "; take another");
    places.push_back(place);
  }
  const Assignment values = spec.columns().front();
  Json list = Json::List{};
  std::mutex no_results;
  TickWatch watch(no_results);
  for (const auto& [stiffness, damping] : places) {
    subject.damping_ns_per_mm = damping;
    StepCounter ticks;
    const TickWatch::Watched watched(watch, ticks, laws_of(values));
    list.push_back({{"stiffness_n_per_mm", stiffness},
                    {"damping_ns_per_mm", damping},
                    {"hits", thinned(curves_of(spec, subject, stiffness, ticks))}});
  }
  return Json{{"seed", spec.seed},
              {"seconds", spec.seconds},
              {"whole_arm", spec.arm},
              {"axes", axes_json(values)},
              {"cells", std::move(list)}}
      .canonical();
}

}  // namespace kerf::zwidth
