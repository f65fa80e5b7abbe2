// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>

#include "controller/kernel/proxy/contact_space.hpp"
#include "tests/rig/geometry.hpp"

// Contact fields in closed form: the truth that proxy and sweep are tested against.

namespace kerf::test {

using namespace extremes;

/// Answers that most fields share: no budget, no free way, air, samples that reach as far as the
/// surface. A field hides those of its own.
template <class N>
struct PlainField {
  using Real = typename N::Real;
  using Place = ContactVec<Real>;

  [[nodiscard]] bool half_spent() const { return false; }
  [[nodiscard]] bool may_query() const { return true; }
  [[nodiscard]] Real deficit() const { return {}; }
  [[nodiscard]] bool is_solid(Place) const { return false; }
  [[nodiscard]] Real free_distance(Place, Place) const { return {}; }
  void orient(const Orientation<N>&) const {}
};

/// One plane, out of the solid along `normal`, and its depth.
template <class N>
Contacts<N> one_plane(Point normal, double depth, Point arm = {}) {
  Contacts<N> contacts;
  contacts.depth = typename N::Real(depth);
  contacts.count = 1;
  contacts.plane[0] = {normal_of<N>(normal), contacts.depth, place_of<N>(arm)};
  return contacts;
}

/// The half-space below the origin along `up`, with contact up to 1 unit above its face. The
/// contact is `arm` from the tool's centre, in the tool's own axes.
template <class N>
class FlatField : public PlainField<N> {
 public:
  using typename PlainField<N>::Place, typename PlainField<N>::Real;

  explicit FlatField(Point up, Point arm = {}) : up_(up), arm_(arm) {}

  Contacts<N> query(Place at) {
    const double height = dot(up_, point_of<N>(at) + turned_arm());
    return height > 1 ? Contacts<N>{} : one_plane<N>(up_, -height, turned_arm());
  }
  [[nodiscard]] bool is_solid(Place at) const { return dot(up_, point_of<N>(at)) < 0; }
  [[nodiscard]] Real free_distance(Place at, Place) const {
    return Real(std::max(0.0, dot(up_, point_of<N>(at) + turned_arm()) - 1));
  }
  void orient(const Orientation<N>& orientation) { orientation_ = orientation; }

 private:
  [[nodiscard]] Point turned_arm() const {
    const auto rows = rows_of(orientation_);
    Point turned{};
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) turned[a] += double(rows[a][b]) * arm_[b];
    }
    return turned;
  }

  Point up_, arm_;
  Orientation<N> orientation_;
};

/// A ball against a solid, in double whatever the numbers of the solver: `Nearest` gives the height
/// of a place above the solid's face and the face's normal there. Contact from 1 unit above to 1
/// unit deep.
template <class N, class Nearest>
class SolidField : public PlainField<N> {
 public:
  using typename PlainField<N>::Place, typename PlainField<N>::Real;

  SolidField(double radius, Nearest nearest) : radius_(radius), nearest_(std::move(nearest)) {}

  Contacts<N> query(Place at) {
    const auto [height, normal] = nearest_(point_of<N>(at));
    if (height - radius_ > 1) return {};
    return one_plane<N>(normal, std::min(1.0, radius_ - height), -radius_ * normal);
  }
  [[nodiscard]] bool is_solid(Place at) const { return nearest_(point_of<N>(at)).first < 0; }
  [[nodiscard]] Real free_distance(Place at, Place) const {
    return Real(std::max(0.0, nearest_(point_of<N>(at)).first - radius_ - 1));
  }

 private:
  double radius_;
  Nearest nearest_;
};

}  // namespace kerf::test
