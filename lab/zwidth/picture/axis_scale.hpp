// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "lab/zwidth/map/part_file.hpp"

namespace kerf::zwidth {

/// Where the values of an axis stand in a picture: numbers at their place, words one after another.
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

}  // namespace kerf::zwidth
