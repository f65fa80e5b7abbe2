// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>

#include "lab/extremes/measures.hpp"
#include "lab/extremes/trap_scenes.hpp"
#include "lab/rig/miller.hpp"
#include "lab/rig/points.hpp"
#include "lab/rig/shaft_touch.hpp"

namespace kerf::extremes {
namespace {

constexpr Point kAbove{0, 4.5, 0};
constexpr double kPressS = 5, kTrappedS = 0.5;
constexpr double kCutsFrom = 1.2;  ///< times the threshold: a press that must cut

/// What a press met.
struct Pressed {
  double longest_s = 0;   ///< of force that must cut and no removal; what a shaft bears is none
  double held_n = 0;      ///< at the end, by a hand that rests
  bool touched = false;   ///< there was force that must cut
  bool by_shaft = false;  ///< a shaft bore the press by right
};

/// The part of the sent force that the head must bear, whatever the shaft does.
double force_on_head(Miller& miller, const LoadedScene& scene, const SceneTool& tool,
                     const ServoOutput& out) {
  const double force_n = length(out.force_n);
  if (tool.shaft.radius_mm <= 0 || force_n <= 0) return force_n;
  Point centre_mm{};
  for (std::size_t i = 0; i < 3; ++i) centre_mm[i] = out.position_mm[i] + out.proxy_offset_mm[i];
  const ShaftTouch touch(scene.volumes[0], miller.servo().density(0));
  return force_n * touch.least_head_share(tool, centre_mm, out.rotation, -1 * out.force_n);
}

/// How a hand presses.
struct Hand {
  Point from, direction;
  double force_n;
  bool along_a_line;  ///< held on it; else it slides wherever it is led
};

/// A hand that presses and trembles by 0.1 mm, for `seconds`; it goes on at 50 mm/s where nothing
/// holds it. The press ends where the tool leaves the matter, or where it is told to be a trap.
Pressed press(Miller& miller, const Hand& how, const LoadedScene& scene, const SceneTool& tool,
              double seconds) {
  constexpr double kMmPerS = 50, kTremorMm = 0.1, kTremorHz = 9, kLeftMm = 5, kRestS = 0.1;
  const double tick_s = 1.0 / scene.servo.rate_hz, step_mm = kMmPerS * tick_s;
  const double lead_mm = how.force_n / scene.force.stiffness_n_per_mm;
  const Point across = unit(cross(how.direction, Point{0.3, 0.1, 1}));
  const double must_cut_n = kCutsFrom * scene.cut.threshold_n;
  Point hand = how.from, proxy = how.from;
  Pressed seen;
  int still = 0;
  // What a shaft may bear changes with the tremor: it is judged some times.
  const auto judged = [tick_s](int n) { return static_cast<int>(n * tick_s * 6 / kTrappedS); };
  const int ticks = static_cast<int>(seconds * scene.servo.rate_hz);
  for (int tick = 0; tick < ticks && length(proxy) <= kLeftMm; ++tick) {
    const Point held =
        how.along_a_line ? how.from + dot(proxy - how.from, how.direction) * how.direction : proxy;
    const Point goal =
        held + lead_mm * how.direction +
        kTremorMm * std::sin(2 * std::numbers::pi * kTremorHz * tick * tick_s) * across;
    const Point way = goal - hand;
    hand = hand + std::min(1.0, step_mm / std::max(step_mm, length(way))) * way;
    const ServoOutput out = miller.step(hand);
    for (std::size_t i = 0; i < 3; ++i) proxy[i] = out.position_mm[i] + out.proxy_offset_mm[i];
    const bool must_cut = length(out.force_n) > must_cut_n;
    seen.touched = seen.touched || must_cut;
    still = must_cut && out.removed_steps == 0 ? still + 1 : 0;
    if (judged(still) > judged(still - 1) &&
        force_on_head(miller, scene, tool, out) <= must_cut_n) {
      seen.by_shaft = true;
      still = 0;
    }
    if (still * tick_s > kTrappedS) {
      seen.longest_s = still * tick_s;
      break;
    }
    // What a shaft may have borne is judged only where it lasts.
    if (tool.shaft.radius_mm <= 0) seen.longest_s = std::max(seen.longest_s, still * tick_s);
  }
  seen.held_n = length(miller.hold(hand, kRestS).force_n);
  return seen;
}

/// The hand takes the tool out of the matter, chooses the next one, turned anyhow, and holds it
/// above. Says where.
Point begin(Miller& miller, std::size_t tool, Dice& dice) {
  const Point from{dice.uniform(-1.5, 1.5), dice.uniform(3, 4), dice.uniform(-1.5, 1.5)};
  miller.travel(kAbove);
  miller.servo().apply({ServoCommand::Kind::select_tool, static_cast<std::uint32_t>(tool)});
  miller.turn_wrist({dice.uniform(-0.5, 0.5), dice.uniform(-0.7, 0.7), dice.uniform(-0.5, 0.5)});
  miller.travel(from);
  static_cast<void>(miller.hold(from, 0.1));
  return from;
}

std::string press_name(const TrapScene& at, const SceneTool& tool, std::uint64_t scene, int press) {
  return tool.name + (tool.shaft.radius_mm > 0 ? " with a shaft" : "") + " in " + at.what +
         ", scene " + std::to_string(scene) + " press " + std::to_string(press);
}

/// What many presses met.
struct Search {
  int made = 0, touched = 0, by_shaft = 0, bad = 0;
  double worst = 0;
};

/// Presses in the scenes from `first` on; adds a row for each with more than `limit`.
template <class Make, class Value>
Search search(int presses, std::uint64_t first, double seconds, double limit, const char* unit_name,
              Make&& make, Value&& value, const RowSink& add_row) {
  Search found;
  for (std::uint64_t number = first; found.made < presses; ++number) {
    const TrapScene at = make(number);
    Miller miller(at.scene, kAbove);
    Dice dice(number ^ 0x5eed);
    for (int i = 0; i < std::min(at.presses, presses - found.made); ++i) {
      const std::size_t tool = (static_cast<std::size_t>(i) + number) % at.scene.tools.size();
      const Point from = begin(miller, tool, dice);
      const Point down = unit(Point{dice.uniform(-0.7, 0.7), -1, dice.uniform(-0.7, 0.7)});
      const Hand hand{from, down, dice.uniform(0.1, 1), dice.uniform(0, 1) < 0.7};
      const Pressed seen = press(miller, hand, at.scene, at.scene.tools[tool], seconds);
      found.touched += seen.touched ? 1 : 0;
      found.by_shaft += seen.by_shaft ? 1 : 0;
      found.worst = std::max(found.worst, value(seen));
      if (value(seen) <= limit) continue;
      ++found.bad;
      add_row({"traps",
               press_name(at, at.scene.tools[tool], number, i),
               value(seen),
               unit_name,
               limit,
               {}});
    }
    found.made += std::min(at.presses, presses - found.made);
  }
  return found;
}

}  // namespace

void measure_traps(const Effort& effort, const RowSink& add_row) {
  constexpr double kSoftS = 1, kSoftN = 0.01;
  const Search hard = search(
      effort.presses, effort.first_scene, kPressS, kTrappedS, "s", trap_scene,
      [](const Pressed& seen) { return seen.longest_s; }, add_row);
  const auto row = [&](const char* what, double value, const char* unit, std::optional<double> must,
                       std::optional<double> aim) {
    add_row({"traps", what, value, unit, must, aim});
  };
  const double made = std::max(hard.made, 1);
  const std::string scenes = "presses of 5 s, from --seed " + std::to_string(effort.first_scene);
  row(scenes.c_str(), hard.made, "", {}, {});
  row("of them with a force that must cut", 100 * hard.touched / made, "%", {}, {});
  row("of them borne by a shaft", 100 * hard.by_shaft / made, "%", {}, {});
  row("presses that stop cutting for over 0.5 s", hard.bad, "", 0, 0);
  row("longest time of force without removal", hard.worst, "s", kTrappedS, 0.2);
  const Search soft = search(
      effort.presses / 4, effort.first_scene, kSoftS, kSoftN, "N", soft_scene,
      [](const Pressed& seen) { return seen.held_n; }, add_row);
  row("force by matter of 0.2 to 0.97 of the iso", soft.worst, "N", kSoftN, 0);
}

}  // namespace kerf::extremes
