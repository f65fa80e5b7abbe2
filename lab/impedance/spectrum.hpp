// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/impedance/stepped_sine.hpp"
#include "lab/stability/axes.hpp"

namespace kerf::impedance {

/// The lowest damping that a hand feels, over frequency; negative: the hand gets energy there.
struct LeastDamping {
  double hz = 0, ns_per_mm = 0;
};

/// One wall on one device over frequency: theory and measurement.
struct Spectrum {
  zwidth::Assignment values;  ///< of the axes
  zwidth::LoopCase subject;
  double stiffness_n_per_mm = 0;
  std::string unmeasured = "beyond the limits of the force";  ///< why a row has no wall
  std::vector<SineResult> rows;                               ///< by frequency, rising

  /// Wall and device's port by theory, in the motion of a row.
  [[nodiscard]] Impedance wall_by_theory(const SineResult& row) const;
  [[nodiscard]] Impedance port_by_theory(const SineResult& row) const;
  /// Of one axis: the measured wall with the device of the theory.
  [[nodiscard]] std::optional<Impedance> port_measured(const SineResult& row) const;
  /// Whether the law is that of the theory while contact lasts: a spring with the backward
  /// difference.
  [[nodiscard]] bool theory_holds() const;
  /// By theory from 1 Hz to half of the Nyquist frequency, without Coulomb friction. Of the wall,
  /// or of the port.
  [[nodiscard]] LeastDamping least_damping(bool port) const;
};

/// |measured / theory| - 1, and the angle between them.
struct Deviation {
  double ratio = 0, deg = 0;
};
[[nodiscard]] Deviation deviation(Impedance measured, Impedance theory);

/// One line for each frequency, then the margins.
[[nodiscard]] std::string text_of(const Spectrum& spectrum);
/// lab/report/impedance.py has its form.
[[nodiscard]] std::string json_of(const Spectrum& spectrum);

}  // namespace kerf::impedance
