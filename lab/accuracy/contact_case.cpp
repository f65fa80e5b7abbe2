// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/contact_case.hpp"

#include <cmath>

namespace kerf::accuracy {

Point ideal_force(const Shape& shape, Point centre_mm, double radius_mm) {
  constexpr std::size_t kPoints = 100'000;
  const double face_mm = radius_mm / 100;  // a ramp wider than the points are apart evens them out
  Point sum;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const Point n = spread_direction(i, kPoints);
    sum = sum + shape.density(centre_mm + radius_mm * n, face_mm) * n;
  }
  return sum * (-4.0 / kPoints);  // 4 pi R^2 of surface over pi R^2
}

std::optional<Contact> contact_on(const Shape& shape, Point start_mm, double depth_mm,
                                  double radius_mm) {
  constexpr int kSteps = 30;
  constexpr double kArrivedMm = 1e-6;
  Point centre = start_mm;
  const auto off_mm = [&] { return shape.distance_mm(centre) - (radius_mm - depth_mm); };
  for (int step = 0; step < kSteps; ++step) centre = centre - off_mm() * shape.normal(centre);
  if (!(std::abs(off_mm()) < kArrivedMm)) return std::nullopt;
  return Contact{centre, depth_mm, shape.normal(centre), ideal_force(shape, centre, radius_mm)};
}

std::vector<Contact> contacts_on(const Shape& shape, std::size_t count, double radius_mm,
                                 double reach_mm) {
  std::vector<Contact> contacts;
  for (std::size_t i = 0; contacts.size() < count; ++i) {
    const double share = (static_cast<double>(contacts.size()) + 0.5) / static_cast<double>(count);
    const auto contact =
        contact_on(shape, spread_place(i) * reach_mm, share * radius_mm, radius_mm);
    if (contact) contacts.push_back(*contact);
  }
  return contacts;
}

}  // namespace kerf::accuracy
