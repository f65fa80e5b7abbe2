// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/accuracy/contact_errors.hpp"
#include "lab/rig/tick_timer.hpp"

namespace kerf::accuracy {

/// One figure of one choice.
struct Figure {
  std::string shape;  ///< plane, ball, torus, plate, crease, layered ball; or all, or what it is of
  std::string metric;
  double figure;
  std::string unit;
};

/// A knob in one position, all others where the servo has them.
struct Entry {
  std::string knob, value;
  bool standard =
      false;  ///< what the servo runs without the method `aligned`: one measurement, in each knob
  TickTimes times;
  std::vector<Figure> figures;
  bool plain = false;  ///< text of the lab: its times are not those of kernels

  /// The figure of a metric; nullptr where it was not measured.
  [[nodiscard]] const double* find(std::string_view metric, std::string_view shape = "all") const;
};

/// How much is measured; the defaults take about a minute on one core.
struct Scope {
  Effort effort;
  std::size_t contacts = 100;  ///< of each shape, and tilts of the plane
  std::size_t walks = 4;       ///< of each shape
  double side_mm = 16;         ///< of the volumes: 128 voxels of 0.125 mm
  int ticks = 1000;            ///< timed
};

/// `told` hears how far it is (0..1) and what is measured now.
[[nodiscard]] std::vector<Entry> study(
    const Scope& scope, const std::function<void(double share, const std::string& what)>& progress);

}  // namespace kerf::accuracy
