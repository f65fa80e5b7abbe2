// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <iosfwd>
#include <ostream>
#include <string>

#include "lab/stability/map_file.hpp"

/// Pictures of a map, as scripts for gnuplot.
namespace kerf::zwidth {

/// The panels of one picture, three side by side and four as a square, over a foot. In pixels.
struct PanelLayout {
  static constexpr int kPanelWidth = 560, kPanelHeight = 450;

  /// `right`: room beside each panel.
  PanelLayout(std::size_t panels, int foot_height, int right_width);

  /// Begins the script: terminal, border, and the layout of the panels.
  void begin(std::ostream& script) const;

  std::size_t across, down;
  int foot, right;
  int width, height;  ///< of the whole picture
};

/// A block of rows that a plot reads as $name.
template <class Rows>
void gnuplot_block(std::ostream& script, const char* name, const Rows& write_rows) {
  script << '$' << name << " << EOD\n";
  write_rows();
  script << "EOD\n";
}

/// The settings that all panels share: the foot's last line. `varies_too`: an axis that has one
/// value in the map and others in the picture.
[[nodiscard]] std::string foot_of(const MapSpec& spec, AxisId varies_too);
[[nodiscard]] std::string foot_of(const MapSpec& spec);

/// A script for gnuplot: one panel for each combination of the axes that are not mapped. With
/// stiffness mapped a panel shows the verdict of every cell and the boundaries over it, else the
/// highest stiffness of every cell.
[[nodiscard]] std::string plot_of(const Part& part);

/// Throws HilError for a map of more panels than a picture holds: before it is measured.
void check_panels(const MapSpec& spec);

}  // namespace kerf::zwidth
