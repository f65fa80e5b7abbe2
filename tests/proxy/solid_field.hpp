// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>

#include "controller/kernel/proxy/contact_space.hpp"
#include "lab/rig/geometry.hpp"

namespace kerf::test {

using namespace extremes;

/// A ball against a solid in closed form, in double whatever the numbers of the solver: `Nearest`
/// gives the height of a place above the solid's face and the face's normal there. Felt from 1 unit
/// above to 1 unit deep.
template <class N, class Nearest>
class SolidField {
 public:
  SolidField(double radius, Nearest nearest) : radius_(radius), nearest_(std::move(nearest)) {}

  Contacts<N> query(ContactVec<typename N::Real> at) {
    const auto [height, normal] = nearest_(point_of<N>(at));
    Contacts<N> felt;
    if (height - radius_ > 1) return felt;
    felt.depth = typename N::Real(std::min(1.0, radius_ - height));
    felt.count = 1;
    felt.plane[0] = {normal_of<N>(normal), felt.depth, place_of<N>(-radius_ * normal)};
    return felt;
  }
  [[nodiscard]] bool half_spent() const { return false; }
  [[nodiscard]] bool may_query() const { return true; }
  [[nodiscard]] bool is_solid(ContactVec<typename N::Real> at) const {
    return nearest_(point_of<N>(at)).first < 0;
  }
  [[nodiscard]] typename N::Real free_distance(ContactVec<typename N::Real> at,
                                               ContactVec<typename N::Real>) const {
    return typename N::Real(std::max(0.0, nearest_(point_of<N>(at)).first - radius_ - 1));
  }
  void turn(const Orientation<N>&) const {}

 private:
  double radius_;
  Nearest nearest_;
};

}  // namespace kerf::test
