// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <optional>
#include <utility>

#include "hil/hil_error.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/map_file.hpp"
#include "lab/stability/one_axis.hpp"
#include "lab/stability/tick_watch.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
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
