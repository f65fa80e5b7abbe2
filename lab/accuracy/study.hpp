// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/accuracy/contact_errors.hpp"
#include "lab/run/lab_run.hpp"

namespace kerf::accuracy {

/// One figure of one choice.
struct Figure {
  std::string shape;  ///< plane, ball, torus, plate, crease, layered ball; or all, or the subject
  std::string metric;
  double figure;
  std::string unit;
};

/// One value of one parameter of the contact; all others have the servo's values.
struct Entry {
  std::string knob, value;
  /// The servo without the method `aligned`: one measurement, in each knob.
  bool standard = false;
  TickTimes times;
  std::vector<Figure> figures;
  bool plain = false;  ///< text of the lab: its times are not those of kernels

  /// The figure of a metric; null if it was not measured.
  [[nodiscard]] const double* find(std::string_view metric, std::string_view shape = "all") const;
};

/// How much is measured; the defaults take about a minute on one core.
struct Scope {
  ErrorCases effort;
  std::size_t contacts = 100;  ///< of each shape, and tilts of the plane
  std::size_t walks = 4;       ///< of each shape
  double side_mm = 16;         ///< of the volumes: 128 voxels of 0.125 mm
  int ticks = 1000;            ///< timed
};

/// `progress` gets the fraction done (0..1) and the current measurement.
[[nodiscard]] std::vector<Entry> study(
    const Scope& scope, const std::function<void(double share, const std::string& what)>& progress);

/// All figures of a study as a table, one row for each: knob, value, shape, metric, figure, unit,
/// and the tick's us p50, p99, max.
[[nodiscard]] std::string csv(const std::vector<Entry>& entries);
/// The figures as JSON, with machine, compiler, day and core of the run (lab/report/accuracy.py).
[[nodiscard]] std::string json(const std::vector<Entry>& entries, int core);

}  // namespace kerf::accuracy
