// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <ostream>

namespace kerf::zwidth {

/// The panels of one picture, three side by side and four as a square, over a foot. In pixels.
struct PanelLayout {
  static constexpr int kPanelWidth = 560, kPanelHeight = 450;

  /// `right`: room beside each panel.
  PanelLayout(std::size_t panels, int foot_height, int right_width);

  /// Begins the script: terminal, border, and where the panels are.
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

}  // namespace kerf::zwidth
