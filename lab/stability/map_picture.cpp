// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/map_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <iosfwd>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "hil/hil_error.hpp"
#include "lab/stability/map_file.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

// Colours of Okabe and Ito, which differ for every kind of colour vision; cells are their light
// shades.
constexpr const char* kRests = "'#CFE8DC'";
constexpr const char* kActive = "'#F7E3A1'";
constexpr const char* kSwings = "'#F0B79B'";
constexpr const char* kNone = "'#D9D9D9'";

/// The positions of the values of an axis in a picture: numbers to scale, words one after another.
/// Each value has a cell that ends half-way to its neighbours; of the stiffness by ratio.
class AxisScale {
 public:
  AxisScale(const MapSpec& spec, std::size_t axis);

  /// Of a value by its text: it is one of the axis.
  [[nodiscard]] std::size_t index(const std::string& text) const;
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  [[nodiscard]] double place(std::size_t i) const { return places_[i]; }
  /// "place of x, of y, then low and high of x, of y": gnuplot's box of one cell.
  [[nodiscard]] static std::string box(const AxisScale& x, std::size_t i, const AxisScale& y,
                                       std::size_t k);

  /// Label, range and tics of gnuplot's axis "x" or "y".
  void set(std::ostream& script, const char* axis) const;

 private:
  [[nodiscard]] double low(std::size_t i) const;
  [[nodiscard]] double high(std::size_t i) const;
  [[nodiscard]] double between(double a, double b) const;
  [[nodiscard]] double beyond(std::size_t i, int side) const;

  std::size_t axis_;
  std::vector<std::string> texts_;
  std::vector<double> places_;
  bool words_ = false, log_ = false;
};

/// Label of an axis in a picture, with its unit.
std::string axis_label(std::size_t axis) {
  if (axis == kAxisCount) return "stiffness of the wall, K (N/mm)";
  const AxisKind& kind = axis_kinds()[axis];
  switch (static_cast<AxisId>(axis)) {
    case AxisId::damping:
      return "damping of the wall, B (N s/mm)";
    case AxisId::delay:
      return "delay from reading to force (periods)";
    case AxisId::quantum:
      return "step of the encoders at the tip (mm)";
    case AxisId::friction:
      return "Coulomb friction of the device (N)";
    default:
      return std::string(kind.name) + (*kind.unit != 0 ? std::string(" (") + kind.unit + ")" : "");
  }
}

AxisScale::AxisScale(const MapSpec& spec, std::size_t axis) : axis_(axis) {
  if (axis == kAxisCount) {
    places_ = spec.stiffness_n_per_mm;
    for (const double value : places_) texts_.push_back(number_text(value));
  } else {
    texts_ = spec.table[axis];
    for (const std::string& text : texts_) {
      places_.push_back(number_in(text).value_or(static_cast<double>(places_.size())));
    }
  }
  words_ = axis < kAxisCount && axis_kinds()[axis].lowest == axis_kinds()[axis].highest;
  if (words_) {
    for (std::size_t i = 0; i < places_.size(); ++i) places_[i] = static_cast<double>(i);
  }
  log_ = axis == kAxisCount;
}

std::size_t AxisScale::index(const std::string& text) const {
  return static_cast<std::size_t>(std::ranges::find(texts_, text) - texts_.begin());
}

std::string AxisScale::box(const AxisScale& x, std::size_t i, const AxisScale& y, std::size_t k) {
  std::ostringstream text;
  text.precision(7);
  text << x.place(i) << ' ' << y.place(k) << ' ' << x.low(i) << ' ' << x.high(i) << ' ' << y.low(k)
       << ' ' << y.high(k);
  return text.str();
}

void AxisScale::set(std::ostream& script, const char* axis) const {
  script << "set " << axis << "label \"" << axis_label(axis_) << "\""
         << (*axis == 'y' ? " offset 1,0" : "") << "\nset " << axis << "range [" << low(0) << ":"
         << high(size() - 1) << "]\n";
  script << (log_ ? "set logscale " : "unset logscale ") << axis << "\n";
  if (!words_) {
    script << "set " << axis << "tics autofreq\n";
    return;
  }
  script << "set " << axis << "tics (";
  for (std::size_t i = 0; i < size(); ++i) {
    script << (i > 0 ? "," : "") << "\"" << texts_[i] << "\" " << i;
  }
  script << ")\n";
}

double AxisScale::low(std::size_t i) const {
  return i > 0 ? between(places_[i - 1], places_[i]) : beyond(i, -1);
}

double AxisScale::high(std::size_t i) const {
  return i + 1 < places_.size() ? between(places_[i], places_[i + 1]) : beyond(i, 1);
}

double AxisScale::between(double a, double b) const {
  return log_ ? std::sqrt(a * b) : (a + b) / 2;
}

/// To one side (-1 or 1) of an end, as far as the border to its neighbour is on the other.
double AxisScale::beyond(std::size_t i, int side) const {
  const double at = places_[i];
  if (size() == 1) {
    const double half = at == 0 || words_ ? 0.5 : std::abs(at) / 2;
    return log_ ? at * std::pow(1.25, side) : at + half * side;
  }
  const double other = places_[side < 0 ? i + 1 : i - 1];
  return log_ ? at * std::sqrt(at / other) : at + (at - other) / 2;
}

constexpr int kLegendWidth = 1120;  // no picture is narrower

constexpr int kLegendHeight = 150;  // pixels: the foot of a map's picture

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

/// Under the panels: the meaning of colours and lines, drawn with the next of them. `verdicts`: the
/// panels show those of each cell, else its highest stiffness.
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

constexpr std::size_t kMostPanels = 12;

/// One combination of the axes that are not mapped, and its columns.
struct Panel {
  std::string title;
  std::vector<std::size_t> columns;
};

std::vector<Panel> panels_of(const Part& part) {
  const std::vector<Assignment> columns = part.spec.columns();
  std::vector<Panel> panels;
  for (const auto& [index, column] : part.columns) {
    std::string title;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      const bool mapped = std::ranges::find(part.spec.mapped, axis) != part.spec.mapped.end();
      if (mapped || part.spec.table[axis].size() < 2) continue;
      const AxisKind& kind = axis_kinds()[axis];
      if (static_cast<AxisId>(axis) == AxisId::loop) {
        title += columns[index][axis] == "ideal"
                     ? "the loop of the theory: linear, exact numbers"
                     : "the loop of kerf: friction, encoder steps, its own force";
        continue;
      }
      title += (title.empty() ? "" : ", ") + std::string(kind.name) + " " + columns[index][axis] +
               (*kind.unit != 0 ? " " : "") + kind.unit;
    }
    const auto at = std::ranges::find(panels, title, &Panel::title);
    if (at == panels.end()) {
      panels.push_back({title, {index}});
    } else {
      at->columns.push_back(index);
    }
  }
  return panels;
}

/// The verdicts of a panel as boxes, and its boundaries as lines.
void draw_verdicts(std::ostream& script, const Part& part, const Panel& panel, const AxisScale& x,
                   const AxisScale& y, std::size_t x_axis) {
  const std::vector<Assignment> columns = part.spec.columns();
  const auto boxes = [&](const char* name, const auto& belongs) {
    gnuplot_block(script, name, [&] {
      script << "-1e9 1 -1e9 -1e9 1 1\n";  // gnuplot refuses a block without a row
      for (const std::size_t c : panel.columns) {
        const Column& column = part.columns.at(c);
        const std::size_t i = x.index(columns[c][x_axis]);
        for (std::size_t k = 0; k < y.size(); ++k) {
          if (!belongs(column, k)) continue;
          script << AxisScale::box(x, i, y, k) << '\n';
        }
      }
    });
  };
  const auto seen = [](const Column& column) { return !column.cells.empty(); };
  boxes("rests", [&](const Column& c, std::size_t k) {
    return seen(c) && !c.cells[k].swings && !c.cells[k].active;
  });
  boxes("active", [&](const Column& c, std::size_t k) {
    return seen(c) && !c.cells[k].swings && c.cells[k].active;
  });
  boxes("swings", [&](const Column& c, std::size_t k) { return seen(c) && c.cells[k].swings; });
  boxes("none", [&](const Column& c, std::size_t) { return !seen(c); });
  gnuplot_block(script, "lines", [&] {
    for (const std::size_t c : panel.columns) {
      const Column& column = part.columns.at(c);
      const Analytic analytic = analytic_of(subject_of(columns[c]));
      const auto shown = [&](double value) {
        return value > 0 && std::isfinite(value) ? number_text(value) : std::string("NaN");
      };
      const bool is = seen(column);
      script << x.place(x.index(columns[c][x_axis])) << ' ' << shown(analytic.exact) << ' '
             << shown(analytic.passive) << ' ' << shown(analytic.quantum) << ' '
             << shown(is ? column.swing.first_n_per_mm : 0) << ' '
             << shown(is ? column.energy.first_n_per_mm : 0) << '\n';
    }
  });
  const auto box = [](const char* name, const char* colour) {
    return std::string("$") + name +
           " using 1:2:3:4:5:6 notitle with boxxyerror fillstyle solid noborder linecolor rgb " +
           colour + ", \\\n  ";
  };
  script << "plot " << box("rests", kRests) << box("active", kActive) << box("swings", kSwings)
         << box("none", kNone) << "$lines using 1:2 notitle with linespoints pointtype "
         << (x.size() == 1 ? 1 : 0)
         << " linewidth 2.5 linecolor rgb "
            "'#000000', "
            "\\\n"
            "  $lines using 1:3 notitle with linespoints pointtype 2 linewidth 2 dashtype 2 "
            "linecolor rgb '#0072B2', "
            "\\\n"
            "  $lines using 1:4 notitle with linespoints pointtype 8 linewidth 2 dashtype 4 "
            "linecolor rgb '#009E73', "
            "\\\n"
            "  $lines using 1:5 notitle with linespoints linewidth 1.5 pointtype 7 pointsize 0.5 "
            "linecolor rgb '#D55E00', \\\n"
            "  $lines using 1:6 notitle with points pointtype 6 pointsize 0.8 linecolor rgb "
            "'#AA4499'\n";
}

/// A first crossing, or the end of the column beyond which it lies.
std::string height_text(double first, const std::vector<double>& stiffness) {
  if (first < stiffness.front()) return "<" + number_text(stiffness.front());
  if (first > stiffness.back()) return ">" + number_text(stiffness.back());
  std::ostringstream text;
  text << std::setprecision(2) << first;
  return text.str();
}

/// The stiffness up to which each cell is fine, as a colour, and as a number if there is room.
void draw_heights(std::ostream& script, const Part& part, const Panel& panel, const AxisScale& x,
                  const AxisScale& y) {
  const std::vector<Assignment> columns = part.spec.columns();
  const std::vector<double>& stiffness = part.spec.stiffness_n_per_mm;
  gnuplot_block(script, "none", [&] {
    script << "-1e9 -1e9 -1e9 -1e9 -1e9 -1e9\n";  // gnuplot refuses a block without a row
    for (const std::size_t c : panel.columns) {
      if (!part.columns.at(c).cells.empty()) continue;
      const std::size_t i = x.index(columns[c][part.spec.mapped[0]]);
      const std::size_t j = y.index(columns[c][part.spec.mapped[1]]);
      script << AxisScale::box(x, i, y, j) << '\n';
    }
  });
  gnuplot_block(script, "cells", [&] {
    for (const std::size_t c : panel.columns) {
      const Column& column = part.columns.at(c);
      if (column.cells.empty()) continue;
      const std::size_t i = x.index(columns[c][part.spec.mapped[0]]);
      const std::size_t j = y.index(columns[c][part.spec.mapped[1]]);
      const double first = std::min(column.swing.first_n_per_mm, column.energy.first_n_per_mm);
      script << AxisScale::box(x, i, y, j) << ' '
             << std::clamp(first, stiffness.front(), stiffness.back()) << ' '
             << height_text(first, stiffness) << '\n';
    }
  });
  const double least = stiffness.front(),
               most = stiffness.back() > least ? stiffness.back() : 1.1 * least;
  script << "set logscale cb\nset cbrange [" << least << ":" << most << "]\nset cbtics add ("
         << stiffness.front() << ", " << stiffness.back()
         << ")\nset cblabel 'highest stiffness, by the stricter rule (N/mm)' offset -1,0\n"
            "set palette defined (0 '#F0B79B', 0.5 '#F7E3A1', 1 '#8CC8B0')\n"
            "plot $none using 1:2:3:4:5:6 notitle with boxxyerror fillstyle solid noborder "
            "linecolor rgb "
         << kNone
         << ", $cells using 1:2:3:4:5:6:7 notitle with boxxyerror fillstyle solid noborder "
            "linecolor palette";
  constexpr std::size_t kMostNumbers = 14;
  if (x.size() <= kMostNumbers && y.size() <= kMostNumbers) {
    script << ", $cells using 1:2:8 notitle with labels";
  }
  script << "\n";
}

}  // namespace

PanelLayout::PanelLayout(std::size_t panels, int foot_height, int right_width)
    : across(std::min<std::size_t>(panels, panels == 4 ? 2 : 3)),
      down((panels + across - 1) / across),
      foot(foot_height),
      right(right_width),
      width(std::max(kLegendWidth, (kPanelWidth + right) * static_cast<int>(across))),
      height(kPanelHeight * static_cast<int>(down) + foot) {}

void PanelLayout::begin(std::ostream& script) const {
  script.precision(7);
  script << "set encoding utf8\nset terminal svg size " << width << ',' << height
         << " dynamic font 'Helvetica,13' background rgb 'white'\n"
            "set border 3 linecolor rgb '#555555' front\n"
            "set tics nomirror out textcolor rgb '#333333'\n"
            "set multiplot layout "
         << down << ',' << across << " margins screen " << 95.0 / width << ","
         << 1 - (25.0 + right) / width << "," << (foot + 60.0) / height << "," << 1 - 45.0 / height
         << " spacing screen " << (95.0 + right) / width << "," << 115.0 / height << "\n";
}

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
  // Differences from the standard.
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

void check_panels(const MapSpec& spec) {
  std::size_t panels = 1;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (std::ranges::find(spec.mapped, axis) != spec.mapped.end()) continue;
    panels *= std::max<std::size_t>(1, spec.table[axis].size());
  }
  if (panels <= kMostPanels) return;
  throw HilError("--plot: " + std::to_string(panels) + " panels, and a picture holds " +
                 std::to_string(kMostPanels) +
                 "; give the axes that are not mapped fewer values, or leave --plot out");
}

std::string plot_of(const Part& part) {
  const std::vector<Panel> panels = panels_of(part);
  std::size_t x_axis = part.spec.mapped[0], y_axis = part.spec.mapped[1];
  if (x_axis == kAxisCount) std::swap(x_axis, y_axis);
  const bool verdicts = y_axis == kAxisCount;
  const AxisScale x(part.spec, x_axis), y(part.spec, y_axis);
  std::ostringstream script;
  const PanelLayout layout(panels.size(), kLegendHeight, verdicts ? 0 : 110);
  layout.begin(script);
  draw_legend(script, part, verdicts, layout);
  for (const Panel& panel : panels) {
    script << "set title \"" << panel.title << "\" noenhanced\n";
    x.set(script, "x");
    y.set(script, "y");
    if (verdicts) {
      draw_verdicts(script, part, panel, x, y, x_axis);
    } else {
      draw_heights(script, part, panel, x, y);
    }
    script << "unset label\nunset arrow\n";
  }
  script << "unset multiplot\n";
  return script.str();
}

}  // namespace kerf::zwidth
