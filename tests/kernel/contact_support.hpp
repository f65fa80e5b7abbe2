// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "tests/kernel/support.hpp"
#include "tests/rig/contact_rig.hpp"

/// Tools and bodies of known shape for the tests of the swept contact; all lengths in units.
namespace kerf::test {

using namespace extremes;

template <class N>
Orientation<N> tool_turn(const std::array<Point, 3>& rotation) {
  RotationRows<N> rows;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) rows[i][j] = typename N::Unit(rotation[i][j]);
  }
  return orientation_of<N>(rows);
}

/// Rows of the rotation that takes the tool's y axis to `axis`.
inline std::array<Point, 3> turned_to(const Point& axis, RandomNumbers& random) {
  const Point a = random.across(axis), b = cross(a, axis);
  return {{{a[0], axis[0], b[0]}, {a[1], axis[1], b[1]}, {a[2], axis[2], b[2]}}};
}

/// A rig that answers for single places, without a sweep.
template <class N>
class QueryRig : public ContactRig<N> {
 public:
  using ContactRig<N>::ContactRig;

  void orient(const std::array<Point, 3>& rotation) {
    this->field().orient(tool_turn<N>(rotation));
  }
  [[nodiscard]] Contacts<N> at(const Point& q) { return this->field().query(place_of<N>(q)); }
  [[nodiscard]] double free_distance(const Point& q, const Point& move) {
    return double(this->field().free_distance(place_of<N>(q), place_of<N>(move)));
  }

  /// How far beyond `q` along `n` the tool rests: its depth is 0 there. Within +-`range`.
  [[nodiscard]] double rest(const Point& q, const Point& n, double range = 1) {
    double inner = -range, outer = range;
    for (int step = 0; step < 16; ++step) {
      const double middle = (inner + outer) / 2;
      (at(q + middle * n).depth > typename N::Real(0) ? inner : outer) = middle;
    }
    return (inner + outer) / 2;
  }
};

}  // namespace kerf::test
