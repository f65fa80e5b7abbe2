// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/results.hpp"

#include <algorithm>
#include <ostream>
#include <set>

#include "lab/zwidth/map/arm.hpp"
#include "lab/zwidth/map/map.hpp"
#include "lab/zwidth/map/tables.hpp"
#include "lab/zwidth/picture/map_plot.hpp"
#include "record/gnuplot.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/text/format.hpp"

namespace kerf::zwidth {
namespace {

std::string crossing_text(const Crossing& crossing) {
  if (crossing.first_n_per_mm == Crossing::kNever) return "above all";
  if (crossing.first_n_per_mm == 0) return "below all";
  return format("%.4g", crossing.first_n_per_mm);
}

}  // namespace

void require_gnuplot() {
  static_cast<void>(gnuplot_svg("set terminal svg\nplot 0\n"));
}

void OutputPaths::declare(Arguments& app) {
  app.option("--csv", csv, "write one row for each cell").shown_as("FILE");
  app.option("--json", json, "write axes, boundaries and cells").shown_as("FILE");
  app.option("--plot", plot, "draw the map beside the analytic limits (SVG)").shown_as("FILE");
}

Outputs::Outputs(const OutputPaths& paths, const std::vector<std::string>& parts)
    : draws_(!paths.plot.empty()),
      csv_("--csv", paths.csv, ".csv"),
      json_("--json", paths.json, ".json"),
      plot_("--plot", paths.plot, ".svg") {
  check_outputs({parts.begin(), parts.end()}, {{"--csv", paths.csv, ".csv"},
                                               {"--json", paths.json, ".json"},
                                               {"--plot", paths.plot, ".svg"}});
  if (draws_) require_gnuplot();
}

void Outputs::write(const Part& part) const {
  csv_.write(csv_of(part));
  json_.write(json_of(part));
  if (draws_) plot_.write(gnuplot_svg(plot_of(part)));
}

void tell(const Part& part, std::ostream& out) {
  const std::vector<Assignment> columns = part.spec.columns();
  std::set<std::string> reasons;
  std::size_t empty_count = 0;
  const auto name_of = [&](std::size_t index) {
    std::string name;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      if (part.spec.table[axis].size() < 2) continue;
      name += std::string(name.empty() ? "" : " ") + axis_kinds()[axis].name + " " +
              columns[index][axis];
    }
    return name;
  };
  std::size_t width = 40;
  for (const auto& [index, column] : part.columns) {
    width = std::max(width, name_of(index).size());
  }
  out << format("%-*s %10s %10s %10s %10s  re-entry\n", int(width), "column (N/mm)", "swings",
                "energy", "exact", "passive");
  for (const auto& [index, column] : part.columns) {
    const Subject subject = subject_of(columns[index]);
    if (column.cells.empty()) {
      const std::string why = impossible(part.spec, subject);
      ++empty_count;
      reasons.insert(why.empty() ? NotMet().what() : why);
      continue;
    }
    const Analytic analytic = analytic_of(subject);
    out << format("%-*s %10s %10s %10.4g %10.4g", int(width), name_of(index).c_str(),
                  crossing_text(column.swing).c_str(), crossing_text(column.energy).c_str(),
                  analytic.exact, analytic.passive);
    if (column.swing.re_entry_from_n_per_mm > 0) {
      out << format("  %.4g to %.4g", column.swing.re_entry_from_n_per_mm,
                    column.swing.re_entry_to_n_per_mm);
    }
    out << '\n';
  }
  if (empty_count > 0) {
    out << empty_count << " of " << part.columns.size()
        << " columns are left empty: " << *reasons.begin() << '\n';
  }
}

}  // namespace kerf::zwidth
