// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/picture/panels.hpp"

#include <algorithm>

namespace kerf::zwidth {
namespace {

constexpr int kLegendWidth = 1120;  // no picture is narrower

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

}  // namespace kerf::zwidth
