// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/proxy/contact_space.hpp"
#include "lab/rig/geometry.hpp"

namespace kerf::test {

using namespace extremes;

/// The half-space below the origin along `up`, felt by a point up to 1 unit above its face: truth
/// in closed form. The contact is `arm` from the tool's centre, in the tool's own axes.
template <class N>
class FlatField {
 public:
  explicit FlatField(Point up, Point arm = {}) : up_(up), arm_(arm) {}

  Contacts<N> query(ContactVec<typename N::Real> at) {
    Contacts<N> felt;
    const double height = dot(up_, point_of<N>(at) + turned_arm());
    if (height > 1) return felt;
    felt.depth = typename N::Real(-height);
    felt.count = 1;
    felt.plane[0] = {normal_of<N>(up_), felt.depth, place_of<N>(turned_arm())};
    return felt;
  }
  [[nodiscard]] bool half_spent() const { return false; }
  [[nodiscard]] bool may_query() const { return true; }
  [[nodiscard]] bool is_solid(ContactVec<typename N::Real> at) const {
    return dot(up_, point_of<N>(at)) < 0;
  }
  [[nodiscard]] typename N::Real free_distance(ContactVec<typename N::Real> at,
                                               ContactVec<typename N::Real>) const {
    const double free = dot(up_, point_of<N>(at) + turned_arm()) - 1;
    return typename N::Real(std::max(0.0, free));
  }
  void turn(const Orientation<N>& turn) { turn_ = turn; }

 private:
  [[nodiscard]] Point turned_arm() const {
    const auto rows = rows_of(turn_);
    Point turned{};
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) turned[a] += double(rows[a][b]) * arm_[b];
    }
    return turned;
  }

  Point up_, arm_;
  Orientation<N> turn_;
};

}  // namespace kerf::test
