// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/picture/portraits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <optional>
#include <sstream>
#include <utility>

#include "hil/hil_error.hpp"
#include "lab/zwidth/map/arm.hpp"
#include "lab/zwidth/map/one_axis.hpp"
#include "lab/zwidth/map/tick_watch.hpp"
#include "lab/zwidth/picture/legend.hpp"
#include "lab/zwidth/picture/panels.hpp"
#include "shared/text/format.hpp"
#include "shared/text/number.hpp"

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

/// A curve without the points that lie within half a pixel of the last one drawn: at 32 kHz there
/// are some hundred for each that is seen. The axes are at least as long as their longest curve, so
/// a share of that is at most the same share of the panel.
class Thinning {
 public:
  explicit Thinning(const Curves& curves) {
    double left = 0, right = 0, low = 0, high = 0;
    for (const Curve& curve : curves) {
      for (const SwingTick& tick : curve) {
        left = std::min(left, tick.tip_mm);
        right = std::max(right, tick.tip_mm);
        low = std::min(low, tick.mm_per_s);
        high = std::max(high, tick.mm_per_s);
      }
    }
    wide_ = (right - left) / (2 * PanelLayout::kPanelWidth);
    tall_ = (high - low) / (2 * PanelLayout::kPanelHeight);
  }

  void write(std::ostream& script, const Curve& curve) const {
    const SwingTick* drawn = nullptr;
    for (const SwingTick& tick : curve) {
      if (drawn != nullptr && &tick != &curve.back() && is_near(*drawn, tick)) continue;
      script << tick.tip_mm << ' ' << tick.mm_per_s << '\n';
      drawn = &tick;
    }
  }

 private:
  [[nodiscard]] bool is_near(const SwingTick& a, const SwingTick& b) const {
    return std::abs(a.tip_mm - b.tip_mm) <= wide_ && std::abs(a.mm_per_s - b.mm_per_s) <= tall_;
  }
  double wide_, tall_;
};

Curves curves_of_axis(const MapSpec& spec, const Subject& subject, double stiffness,
                      TickMeter& ticks) {
  Curves curves;
  for (const double speed : kHitsMmPerS) {
    Curve& curve = curves.emplace_back();
    static_cast<void>(hit_one_axis(subject, stiffness, speed, spec.seconds, spec.seed, ticks,
                                   [&](const SwingTick& tick) { curve.push_back(tick); }));
  }
  return curves;
}

Curves curves_of_arm(const MapSpec& spec, const Subject& subject, double stiffness,
                     TickMeter& ticks) {
  Curves curves(kArmHits);
  watch_arm(walls_scene(subject), subject, stiffness, spec.seconds, spec.seed, ticks,
            [&](std::size_t hit) {
              return [&curve = curves[hit]](const SwingTick& tick) { curve.push_back(tick); };
            });
  std::erase_if(curves, [](const Curve& curve) { return curve.empty(); });
  if (curves.empty()) throw NotMet();
  return curves;
}

void draw(std::ostream& script, const std::string& title, const Curves& curves) {
  struct Hit {
    const char* name;
    const char* colour;
  };
  constexpr std::array<Hit, kArmHits> kHits{{{"push", "#0072B2"},
                                             {"50 mm/s", "#D55E00"},
                                             {"200 mm/s", "#009E73"},
                                             {"slide", "#CC79A7"},
                                             {"corner", "#E69F00"}}};
  const Thinning thinning(curves);
  for (std::size_t h = 0; h < curves.size(); ++h) {
    gnuplot_block(script, ("hit" + std::to_string(h)).c_str(),
                  [&] { thinning.write(script, curves[h]); });
  }
  script << "set title \"" << title << "\" noenhanced\nplot ";
  for (std::size_t h = curves.size(); h-- > 0;) {
    script << "$hit" << h << " using 1:2 title '" << kHits[h].name << "' with lines linecolor rgb '"
           << kHits[h].colour << (h > 0 ? "', " : "'\n");
  }
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
  Subject subject = subject_of(spec.columns().front());
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
  std::ostringstream script;
  const PanelLayout layout(places.size(), 50, 0);
  layout.begin(script);
  script << "set label 1 \"" << foot_of(spec, AxisId::damping) << "\" at screen 0.02, screen "
         << 30.0 / layout.height << " left noenhanced font ',11' textcolor rgb '#555555'\n";
  script << "set xlabel 'place of the tip, wall at 0 (mm)'\nset ylabel 'speed (mm/s)'\n"
            "set grid back linecolor rgb '#dddddd'\nset key right top horizontal samplen 2\nset "
            "offsets graph 0, 0, graph 0.15, 0\n";
  std::mutex no_results;
  TickWatch watch(no_results);
  for (const auto& [stiffness, damping] : places) {
    subject.damping_ns_per_mm = damping;
    TickMeter ticks;
    const TickWatch::Watched watched(watch, ticks, laws_of(spec.columns().front()));
    const Curves curves = spec.arm ? curves_of_arm(spec, subject, stiffness, ticks)
                                   : curves_of_axis(spec, subject, stiffness, ticks);
    draw(script, format("K %g N/mm, B %g N s/mm", stiffness, damping), curves);
  }
  script << "unset multiplot\n";
  return script.str();
}

}  // namespace kerf::zwidth
