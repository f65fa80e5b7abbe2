// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/subjects.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kerf::accuracy {
namespace {

constexpr double kReachMm = 2;     // the torus is the widest, and shows most of itself
constexpr double kTiltSideMm = 5;  // room for the tool and its ways
/// Off the lattice, so that no voxel is a special one.
constexpr Point kCentre{0.37 * kVoxelMm, 0.11 * kVoxelMm, -0.23 * kVoxelMm};

std::vector<Shape> solids() {
  return {ball(kCentre, 10 * kVoxelMm), torus({1, 2, 3}, 2.0, 0.8),
          thin_plate({2, -1, 3}, 2 * kVoxelMm), crease(), layered_ball(kCentre, 1.5, 0.4)};
}

}  // namespace

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

Subjects::Subjects(std::size_t contacts, std::size_t walks) : walks_(walks) {
  for (std::size_t i = 0; i < contacts; ++i) {
    const Point place = spread_place(i);
    const Shape tilted = plane(spread_direction(i, contacts), place.x * kVoxelMm);
    // Each plane has one contact: they share the depths among them.
    const double depth_mm = kToolMm * (place.y + 1) / 2;
    const auto contact = contact_on(tilted, place * kVoxelMm, depth_mm, kToolMm);
    if (contact) planes_.push_back({tilted, {*contact}});
  }
  for (const Shape& solid : solids()) {
    solids_.push_back({solid, contacts_on(solid, contacts, kToolMm, kReachMm)});
  }
}

std::vector<Subject> Subjects::in_voxels(double voxel_mm, double side_mm) const {
  Subject plane{"plane", {}};
  for (const Touched& tilted : planes_) {
    const std::size_t walks = plane.cases.size() < walks_ ? 1 : 0;
    plane.cases.push_back(
        {tilted.shape, volume_of(tilted.shape, kTiltSideMm, voxel_mm), tilted.contacts, walks});
  }
  std::vector<Subject> subjects{std::move(plane)};
  for (const Touched& solid : solids_) {
    subjects.push_back({solid.shape.name,
                        {{solid.shape, volume_of(solid.shape, side_mm, voxel_mm), solid.contacts,
                          std::min(walks_, solid.contacts.size())}}});
  }
  return subjects;
}

}  // namespace kerf::accuracy
