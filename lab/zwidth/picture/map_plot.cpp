// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/picture/map_plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <sstream>

#include "hil/hil_error.hpp"
#include "lab/zwidth/map/tables.hpp"
#include "lab/zwidth/picture/axis_scale.hpp"
#include "lab/zwidth/picture/colours.hpp"
#include "lab/zwidth/picture/legend.hpp"
#include "lab/zwidth/picture/panels.hpp"
#include "shared/text/number.hpp"

namespace kerf::zwidth {
namespace {

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

/// A first crossing, or beyond which end of the column it lies.
std::string height_text(double first, const std::vector<double>& stiffness) {
  if (first < stiffness.front()) return "<" + number_text(stiffness.front());
  if (first > stiffness.back()) return ">" + number_text(stiffness.back());
  std::ostringstream text;
  text << std::setprecision(2) << first;
  return text.str();
}

/// The stiffness up to which each cell is fine, as a colour, and as a number where there is room.
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
