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

/// One run: a press, and which of its seed's phases of the encoders it has; of the whole arm, which
/// hit.
struct Attempt {
  Press press;
  std::size_t nth = 0;
};

/// By which a map finds the first stiffness that is bad.
using Rule = bool LimitCycle::*;

/// The worst of some runs, and the first one that was bad by each rule.
struct Seen {
  LimitCycle worst;
  Attempt swings, active;

  void join(const LimitCycle& run, const Attempt& attempt) {
    if (run.swings && !worst.swings) swings = attempt;
    if (run.active && !worst.active) active = attempt;
    worst.join(run);
  }
  [[nodiscard]] const Attempt& bad_by(Rule rule) const {
    return rule == &LimitCycle::swings ? swings : active;
  }
};

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

  Column column() {
    Column column;
    column.swing = first_ones(&LimitCycle::swings);
    column.energy = first_ones(&LimitCycle::active);
    for (const double stiffness : spec_.stiffness_n_per_mm) {
      column.cells.push_back(cell(stiffness));
    }
    find_re_entry(&LimitCycle::swings, column.cells, column.swing);
    find_re_entry(&LimitCycle::active, column.cells, column.energy);
    for (const auto& [place, seen] : known_) {  // the lowest of all that have a verdict
      if (!seen.worst.undecided) continue;
      column.undecided_n_per_mm = place.first;
      break;
    }
    return column;
  }

 private:
  /// Where a seed is first bad by a rule, and by which run.
  struct Critical {
    double stiffness;
    std::size_t seed;
    Attempt attempt;
  };

  /// The worst of all seeds, and of the runs that were bad first.
  LimitCycle cell(double stiffness) {
    LimitCycle worst;
    for (std::size_t i = 0; i < seeds_ && !worst.worst(); ++i) worst.join(at(stiffness, i).worst);
    for (const Critical& one : critical_) {
      if (worst.worst()) break;
      if (stiffness >= one.stiffness) worst.join(run(stiffness, one.seed, one.attempt, 1));
    }
    return worst;
  }

  StabilityBoundary first_ones(Rule rule) {
    StabilityBoundary found;
    found.last_n_per_mm = 0;
    for (std::size_t i = 0; i < seeds_; ++i) {
      const double first = first_of(rule, i);
      found.by_seed_n_per_mm.push_back(first);
      found.first_n_per_mm = std::min(found.first_n_per_mm, first);
      found.last_n_per_mm = std::max(found.last_n_per_mm, first);
    }
    return found;
  }

  void find_re_entry(Rule rule, const std::vector<LimitCycle>& cells,
                     StabilityBoundary& found) const {
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
  }

  /// From the lowest stiffness up, in steps so fine that an island of swings between two cells of
  /// the map is found; then down from there. The whole arm, which is slower, has the map's steps,
  /// halved to 0.5 %.
  double first_of(Rule rule, std::size_t seed) {
    constexpr double kFine = 1.01, kClose = 1.005;
    const auto bad = [&](double stiffness) { return at(stiffness, seed).worst.*rule; };
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
        if (!spec_.arm) return lowest(rule, seed, at(high, seed).bad_by(rule), high);
        while (high > low * kClose) {
          const double middle = seven_digits(std::sqrt(low * high));
          (bad(middle) ? high : low) = middle;
        }
        return high;
      }
    }
    return StabilityBoundary::kNever;
  }

  /// Down from a stiffness at which `attempt` is bad: by that press, then by presses beside it,
  /// from a quarter of the ranges to a thirty-second, as long as one of them is bad 2 % lower; then
  /// halved to 0.5 %. 0: below the lowest of the map.
  double lowest(Rule rule, std::size_t seed, Attempt attempt, double high) {
    constexpr double kDown = 1.02, kClose = 1.005, kFirstShare = 0.25, kLastShare = 1.0 / 32;
    const auto bad = [&](double stiffness, const Press& press) {
      return run(stiffness, seed, {press, attempt.nth}, 1).*rule;
    };
    for (double share = kFirstShare; share >= kLastShare;) {
      const double low = seven_digits(high / kDown);
      std::vector<Press> presses = presses_beside(subject_.press, attempt.press, share);
      presses.insert(presses.begin(), attempt.press);
      const auto worse = std::ranges::find_if(presses, [&](const Press& p) { return bad(low, p); });
      if (worse == presses.end()) {
        share /= 2;
        continue;
      }
      attempt.press = *worse;
      high = low;
      if (high < spec_.stiffness_n_per_mm.front()) return 0;
    }
    for (double low = seven_digits(high / kDown); high > low * kClose;) {
      const double middle = seven_digits(std::sqrt(low * high));
      (bad(middle, attempt.press) ? high : low) = middle;
    }
    critical_.push_back({high, seed, attempt});
    return high;
  }

  const Seen& at(double stiffness, std::size_t nth) {
    const auto [place, is_new] = known_.try_emplace({stiffness, nth});
    if (is_new) place->second = measured(stiffness, nth, 1);
    return place->second;
  }

  /// A first look between two cells, with a fifth of the limit: what swings there gets the verdict.
  const LimitCycle& looked(double stiffness, std::size_t nth) {
    constexpr double kPart = 0.2;
    const auto [place, is_new] = looked_.try_emplace({stiffness, nth});
    if (is_new) place->second = measured(stiffness, nth, kPart).worst;
    return place->second;
  }

  /// The runs that a stiffness gets of each seed: the standard presses, and others from one
  /// stiffness to the next, so that the steps of a search cover the ranges of what is not given.
  /// The same in all columns, so that two columns differ by their values alone.
  [[nodiscard]] std::vector<Attempt> attempts(double stiffness, std::size_t nth) const {
    // Without any the first swing of an Omni without delay at B = 0.02 N s/mm is 5.7, not 2.6.
    constexpr std::size_t kOthers = 2;
    std::vector<Attempt> all;
    const std::vector<Press> standard = standard_presses(subject_.press);
    if (spec_.arm) {
      for (std::size_t hit = 0; hit < kArmPress; ++hit) all.push_back({standard.front(), hit});
    } else {
      for (const Press& press : standard) all.push_back({press, all.size()});
    }
    if (subject_.press.is_one()) return all;
    // Of an octave 128 parts, about 0.8 % each: the logarithm without its rounding. Seeds are far
    // apart.
    int octave = 0;
    const double part = std::frexp(stiffness, &octave);
    constexpr int kLowest = 64;
    constexpr std::uint64_t kApart = 100'003, kSeeds = 4096;
    const auto step = static_cast<std::uint64_t>(128 * (kLowest + octave + 2 * part));
    const std::uint64_t first = (spec_.seed + nth) % kSeeds * kApart + step * kOthers;
    for (std::size_t i = 0; i < (spec_.arm ? 1 : kOthers); ++i) {
      all.push_back({press_of(subject_.press, first + i), all.size()});
    }
    return all;
  }

  /// All runs of a seed, until one has shown the worst by both rules.
  Seen measured(double stiffness, std::size_t nth, double part) {
    const std::vector<Attempt> all = attempts(stiffness, nth);
    Seen seen;
    for (const Attempt& attempt : all) {
      seen.join(run(stiffness, nth, attempt, part), attempt);
      if (seen.worst.worst()) break;
    }
    if (is_arithmetic(seen.worst, stiffness, all, part)) {
      seen.worst.swings = seen.worst.active = seen.worst.undecided = false;
      seen.worst.arithmetic = true;
    }
    return seen;
  }

  /// One run, to a part of the time that it needs. Nothing, if that is more than a run may last:
  /// a flick of a heavy arm that is pushed lightly.
  LimitCycle run(double stiffness, std::size_t nth, const Attempt& attempt, double part) {
    const double needed_s = needed_seconds(subject_, stiffness, attempt.press);
    if (needed_s > kLongestLimitS) return {};
    const double limit_s = part * std::max(spec_.seconds, needed_s);
    const std::uint64_t seed = spec_.seed + nth;
    if (spec_.arm) {
      return hit_with_arm(scene_, subject_, stiffness, attempt.nth, attempt.press, limit_s, seed,
                          ticks_);
    }
    const std::uint64_t phase = seed == 0 ? 0 : (seed << 32) + attempt.nth;
    return hit_one_axis(subject_, stiffness, attempt.press, limit_s, phase, ticks_);
  }

  /// Whether a motion that does not rest is that of fixed numbers alone: without encoder steps, too
  /// small for any encoder, and at rest in double.
  bool is_arithmetic(const LimitCycle& fixed, double stiffness, const std::vector<Attempt>& all,
                     double part) {
    constexpr double kFinestStepMm = 1e-3;  // a tenth of the omega's (docs/gains.md)
    if (fixed.rests() || fixed.travel_mm > kFinestStepMm || spec_.arm ||
        subject_.numeric != NumericKind::fixed || subject_.loop.quantum_mm > 0) {
      return false;
    }
    LoopCase exact = subject_;
    exact.numeric = NumericKind::float64;
    return std::ranges::all_of(all, [&](const Attempt& attempt) {
      const double limit_s =
          part * std::max(spec_.seconds, needed_seconds(subject_, stiffness, attempt.press));
      return hit_one_axis(exact, stiffness, attempt.press, limit_s, 0, ticks_).rests();
    });
  }

  const MapSpec& spec_;
  LoopCase subject_;
  StepCounter& ticks_;
  std::size_t seeds_;
  LoadedScene scene_;  ///< of the whole arm
  // By stiffness and seed.
  std::map<std::pair<double, std::size_t>, Seen> known_;
  std::map<std::pair<double, std::size_t>, LimitCycle> looked_;
  std::vector<Critical> critical_;
};

}  // namespace

double needed_seconds(const LoopCase& subject, double stiffness_n_per_mm, const Press& press) {
  const SampledLoop& loop = subject.loop;
  const double mass_kg = loop.mass_kg + loop.hand.mass_kg;
  const double n_per_m = 1000 * (stiffness_n_per_mm + loop.hand.stiffness_n_per_mm);
  const double ns_per_m =
      1000 * (loop.viscous_ns_per_mm + subject.damping_ns_per_mm + loop.hand.damping_ns_per_mm);
  constexpr double kWindows = 16, kConstants = 12, kOfDecay = 0.01, kFall = 0.09;
  const bool creeps = ns_per_m * ns_per_m > 4 * mass_kg * n_per_m;
  return std::max({kWindows * slowest_swing_s(subject, stiffness_n_per_mm, press),
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
  if (subject.limits && subject.press.given[0] >= LimitSettings().force_n) {
    return format(
        "push %g N is not below %g, the peak of the force: the hand goes through the wall",
        *subject.press.given[0], LimitSettings().force_n);
  }
  const double needed_s = needed_seconds(subject, spec.stiffness_n_per_mm.front(),
                                         standard_presses(subject.press).back());
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
  if (!impossible(spec, subject).empty()) return {};
  try {
    return ColumnRun(spec, subject, ticks).column();
  } catch (const NotMet&) {
    return {};
  } catch (const LawError& error) {
    throw HilError("--law: " + subject.force_law.name + error.what());
  }
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

struct Curve {
  std::string name;  ///< of the hit
  std::vector<SwingTick> ticks;
};
using Curves = std::vector<Curve>;

/// The curves without the points that lie within a thousandth of both axes of the last one kept: at
/// 32 kHz there are some hundred for each that is seen.
Json thinned(const Curves& curves) {
  double left = 0, right = 0, low = 0, high = 0;
  for (const Curve& curve : curves) {
    for (const SwingTick& tick : curve.ticks) {
      left = std::min(left, tick.tip_mm);
      right = std::max(right, tick.tip_mm);
      low = std::min(low, tick.mm_per_s);
      high = std::max(high, tick.mm_per_s);
    }
  }
  constexpr double kLeast = 1e-3;
  Json hits = Json::List{};
  for (const Curve& curve : curves) {
    Json tip = Json::List{}, speed = Json::List{};
    const SwingTick* kept = nullptr;
    for (const SwingTick& tick : curve.ticks) {
      if (kept != nullptr && &tick != &curve.ticks.back() &&
          std::abs(tick.tip_mm - kept->tip_mm) <= kLeast * (right - left) &&
          std::abs(tick.mm_per_s - kept->mm_per_s) <= kLeast * (high - low)) {
        continue;
      }
      tip.push_back(tick.tip_mm);
      speed.push_back(tick.mm_per_s);
      kept = &tick;
    }
    hits.push_back(
        {{"name", curve.name}, {"tip_mm", std::move(tip)}, {"mm_per_s", std::move(speed)}});
  }
  return hits;
}

Curves curves_of(const MapSpec& spec, const LoopCase& subject, double stiffness,
                 StepCounter& ticks) {
  const std::vector<Press> presses = standard_presses(subject.press);
  const LoadedScene scene = spec.arm ? walls_scene(subject) : LoadedScene();
  const auto speed = [](double mm_per_s) {
    return mm_per_s > 0 ? format("%g mm/s", mm_per_s) : std::string("push");
  };
  Curves curves;
  if (spec.arm) {
    for (const double mm_per_s : kHitsMmPerS) curves.push_back({speed(mm_per_s), {}});
    curves.push_back({"slide", {}});
    curves.push_back({"corner", {}});
  } else {
    for (const Press& press : presses) curves.push_back({speed(press.hit_mm_per_s), {}});
  }
  for (std::size_t hit = 0; hit < curves.size(); ++hit) {
    const auto watch = [&seen = curves[hit].ticks](const SwingTick& tick) { seen.push_back(tick); };
    static_cast<void>(spec.arm ? hit_with_arm(scene, subject, stiffness, hit, presses.front(),
                                              spec.seconds, spec.seed, ticks, watch)
                               : hit_one_axis(subject, stiffness, presses[hit], spec.seconds,
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
      throw HilError("--cells: " + cell + " is given twice; name each once");
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
