// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/picture/legend.hpp"

#include <ostream>
#include <string>
#include <vector>

#include "lab/zwidth/map/tables.hpp"
#include "lab/zwidth/picture/colours.hpp"
#include "shared/text/number.hpp"

namespace kerf::zwidth {
namespace {

/// No line is longer than the narrowest picture is wide.
std::string in_lines(std::string text) {
  constexpr std::size_t kWide = 165;
  for (std::size_t begin = 0; text.size() - begin > kWide;) {
    const std::size_t gap = text.rfind(", ", begin + kWide);
    if (gap == std::string::npos || gap <= begin) break;
    text.replace(gap + 1, 1, "\\n");
    begin = gap + 3;
  }
  return text;
}

}  // namespace

std::string foot_of(const MapSpec& spec, AxisId varies_too) {
  const Assignment first = spec.columns().front();
  const auto varies = [&](AxisId axis) {
    return axis == varies_too || spec.table[index_of(axis)].size() > 1;
  };
  const auto say = [&](AxisId axis, const char* before, const char* after) {
    return varies(axis) ? std::string() : before + value_of(first, axis) + after + ", ";
  };
  const bool loops = varies(AxisId::loop) || varies(AxisId::device);
  std::string text = say(AxisId::device, "", "");
  if (!varies(AxisId::device)) {
    text += say(AxisId::mass, "", " kg") + say(AxisId::viscous, "b ", " N s/mm");
  }
  if (!loops) {
    text += say(AxisId::friction, "friction ", " N") + say(AxisId::quantum, "encoder ", " mm") +
            say(AxisId::numeric, "", "") + say(AxisId::estimator, "speed by ", "");
  }
  // What differs from the standard.
  const auto own = [&](AxisId axis, const char* standard, const std::string& before,
                       const char* after) {
    return varies(axis) || value_of(first, axis) == standard
               ? std::string()
               : before + value_of(first, axis) + after + ", ";
  };
  if (!loops) text += own(AxisId::law, "coupling", "law ", "");
  text += own(AxisId::stabiliser, "none", "stabiliser ", "") +
          own(AxisId::filter, "0", "low-pass ", " ms");
  if (!loops) text += own(AxisId::limits, "on", "limits ", "");
  if (spec.arm) text += own(AxisId::mode, "0", "mode ", " Hz");
  text += say(AxisId::rate, "", " Hz") + say(AxisId::delay, "delay ", " periods") +
          say(AxisId::damping, "B ", " N s/mm") + say(AxisId::hand, "hand ", "");
  return in_lines(text + (spec.arm ? "whole arm, " : "one axis, ") +
                  "hits: a push, 50 and 200 mm/s, " + (spec.arm ? "a slide, a corner, " : "") +
                  number_text(spec.seconds) + " s each, seed " + std::to_string(spec.seed));
}

std::string foot_of(const MapSpec& spec) {
  constexpr auto kNone = static_cast<AxisId>(kAxisCount);
  return foot_of(spec, kNone);
}

void draw_legend(std::ostream& script, const Part& part, bool verdicts, const PanelLayout& layout) {
  const auto line = [&](int row) { return (layout.foot - 30.0 - 24 * row) / layout.height; };
  script << "set label \"" << foot_of(part.spec) << "\" at screen 0.02, screen " << line(4)
         << " left noenhanced font ',11' textcolor rgb '#555555'\n";
  struct Item {
    const char* text;
    std::string style;
    double x;
    int row;
  };
  const auto cell = [](const char* colour) {
    return std::string("pointtype 5 pointsize 2 linecolor rgb ") + colour;
  };
  if (!verdicts) {
    script
        << "set label \"not stable even without a wall, or not measured\" at screen 0.03, screen "
        << line(3) << " left point " << cell(kNone) << " offset 1.2,0\n";
    return;
  }
  const Item items[] = {
      {"comes to rest", cell(kRests), 0.03, 0},
      {"travel small or falling, but the wall goes on giving energy", cell(kActive), 0.03, 1},
      {"swings on (a limit cycle, or worse)", cell(kSwings), 0.03, 2},
      {"not stable even without a wall, or not measured", cell(kNone), 0.03, 3},
      {"measured: first swing", "pointtype 7 pointsize 0.9 linecolor rgb '#D55E00'", 0.40, 0},
      {"measured: first energy that goes on", "pointtype 6 pointsize 1 linecolor rgb '#AA4499'",
       0.40, 1},
  };
  for (const Item& item : items) {
    script << "set label \"" << item.text << "\" at screen " << item.x << ", screen "
           << line(item.row) << " left point " << item.style << " offset 1.2,0\n";
  }
  bool is_passive = false, is_quantum = false;  // some column has a point of that line
  for (const Assignment& column : part.spec.columns()) {
    const Analytic analytic = analytic_of(subject_of(column));
    const auto is_seen = [&](double value) {
      return value >= part.spec.stiffness_n_per_mm.front() &&
             value <= part.spec.stiffness_n_per_mm.back();
    };
    is_passive |= is_seen(analytic.passive);
    is_quantum |= is_seen(analytic.quantum);
  }
  std::vector<Item> lines{{"linear loop, exact (no friction, no encoder steps)",
                           "linewidth 2.5 linecolor rgb '#000000'", 0.65, 0}};
  const auto add = [&](const char* text, const char* colour, int dash, int point) {
    const int row = static_cast<int>(lines.size());
    const std::string style = std::string("linewidth 2 linecolor rgb ") + colour;
    lines.push_back({text, style + " dashtype " + std::to_string(dash), 0.65, row});
    script << "set label \"\" at screen " << lines.back().x + 0.0075 << ", screen " << line(row)
           << " point pointtype " << point << ' ' << style << '\n';
  };
  if (is_passive) add("passive: stable with any hand", "'#0072B2'", 2, 2);
  if (is_quantum) add("friction swallows encoder steps (for B = 0)", "'#009E73'", 4, 8);
  for (const Item& item : lines) {
    script << "set arrow from screen " << item.x - 0.01 << ", screen " << line(item.row)
           << " to screen " << item.x + 0.025 << ", screen " << line(item.row) << " nohead "
           << item.style << "\nset label \"" << item.text << "\" at screen " << item.x + 0.033
           << ", screen " << line(item.row) << " left\n";
  }
}

}  // namespace kerf::zwidth
