// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/subjects.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

namespace kerf::accuracy {
namespace {

std::int32_t middle_of(std::int32_t n) {
  return n / 2;
}

constexpr double kReachMm = 2;     // the torus is the widest, and shows most of itself
constexpr double kTiltSideMm = 5;  // room for the tool and its ways
/// Off the lattice, so that no voxel is a special one.
constexpr Point kCentre{0.37 * kVoxelMm, 0.11 * kVoxelMm, -0.23 * kVoxelMm};

std::vector<Shape> solids() {
  return {ball(kCentre, 10 * kVoxelMm), torus({1, 2, 3}, 2.0, 0.8),
          thin_plate({2, -1, 3}, 2 * kVoxelMm), crease(), layered_ball(kCentre, 1.5, 0.4)};
}

}  // namespace

Point Shape::normal(Point at) const {
  constexpr double kStep = 1e-5;  // mm: far below a voxel, far above the rounding of a double
  const auto slope = [&](Point step) { return distance_mm(at + step) - distance_mm(at - step); };
  return unit({slope({kStep, 0, 0}), slope({0, kStep, 0}), slope({0, 0, kStep})});
}

double Shape::density(Point at, double edge_mm) const {
  double sum = 0;
  for (const Layer& layer : layers) {
    sum += layer.density * std::clamp(0.5 - layer.distance_mm(at) / edge_mm, 0.0, 1.0);
  }
  return sum;
}

Shape plane(Point normal, double offset_mm) {
  const Point n = unit(normal);
  return {"plane", {{[=](Point at) { return dot(n, at) - offset_mm; }, 1.0}}};
}

Shape ball(Point centre, double radius_mm) {
  return {"ball", {{[=](Point at) { return norm(at - centre) - radius_mm; }, 1.0}}};
}

Shape torus(Point axis, double ring_mm, double tube_mm) {
  const Point n = unit(axis);
  const auto distance = [=](Point at) {
    const double along = dot(n, at);
    return std::hypot(norm(at - along * n) - ring_mm, along) - tube_mm;
  };
  return {"torus", {{distance, 1.0}}};
}

Shape thin_plate(Point normal, double thickness_mm) {
  const Point n = unit(normal);
  return {"plate", {{[=](Point at) { return std::abs(dot(n, at)) - thickness_mm / 2; }, 1.0}}};
}

Shape crease() {
  const Point a = unit({1, 2, 3});
  const Point b = unit({3, 0, -1});  // at right angles to `a`
  const auto distance = [=](Point at) {
    const double above_a = dot(a, at), above_b = dot(b, at);
    return above_a < 0 && above_b < 0 ? -std::hypot(above_a, above_b) : std::min(above_a, above_b);
  };
  return {"crease", {{distance, 1.0}}};
}

Shape layered_ball(Point centre, double radius_mm, double enamel_mm) {
  const auto distance = [=](double radius) {
    return [=](Point at) { return norm(at - centre) - radius; };
  };
  return {"layered ball", {{distance(radius_mm), 1.0}, {distance(radius_mm - enamel_mm), -0.4}}};
}

VoxelVec<double> AnalyticVolume::voxel_from_mm(Point at) const noexcept {
  const auto along = [&](double mm, std::int32_t n) { return mm / voxel_mm + middle_of(n); };
  return {along(at.x, grid.nx), along(at.y, grid.ny), along(at.z, grid.nz)};
}

Point AnalyticVolume::mm_from_voxel(VoxelVec<double> at) const noexcept {
  const auto along = [&](double voxel, std::int32_t n) {
    return (voxel - middle_of(n)) * voxel_mm;
  };
  return {along(at.x, grid.nx), along(at.y, grid.ny), along(at.z, grid.nz)};
}

AnalyticVolume volume_of(const Shape& shape, double side_mm, double voxel_mm, double ramp_vox) {
  const auto n = static_cast<std::int32_t>(std::lround(side_mm / voxel_mm));
  AnalyticVolume volume{{n, n, n}, voxel_mm, {}};
  volume.density.reserve(volume.grid.voxel_count());
  for (std::int32_t z = 0; z < n; ++z) {
    for (std::int32_t y = 0; y < n; ++y) {
      for (std::int32_t x = 0; x < n; ++x) {
        const Point at = volume.mm_from_voxel({double(x), double(y), double(z)});
        volume.density.push_back(static_cast<Density>(
            std::lround(kDensityMax * shape.density(at, ramp_vox * voxel_mm))));
      }
    }
  }
  return volume;
}

Point spread_direction(std::size_t i, std::size_t count) {
  const double turn = static_cast<double>(i) * 2 * std::numbers::pi / std::numbers::phi;
  const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
  const double around = std::sqrt(1 - z * z);
  return {around * std::cos(turn), around * std::sin(turn), z};
}

Point spread_place(std::size_t i) {
  const auto digits_reversed = [i](std::size_t base) {
    double value = 0, share = 1;
    for (std::size_t rest = i + 1; rest > 0; rest /= base) {
      share /= static_cast<double>(base);
      value += share * static_cast<double>(rest % base);
    }
    return 2 * value - 1;
  };
  return {digits_reversed(2), digits_reversed(3), digits_reversed(5)};
}

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

TestShape Subjects::planes_in_voxels(double voxel_mm, double side_mm, double ramp_vox) const {
  TestShape plane{"plane", {}};
  for (const Touched& tilted : planes_) {
    const std::size_t walks = plane.cases.size() < walks_ ? 1 : 0;
    plane.cases.push_back({tilted.shape, volume_of(tilted.shape, side_mm, voxel_mm, ramp_vox),
                           tilted.contacts, walks});
  }
  return plane;
}

std::vector<TestShape> Subjects::in_voxels(double voxel_mm, double side_mm, double ramp_vox) const {
  std::vector<TestShape> subjects{planes_in_voxels(voxel_mm, kTiltSideMm, ramp_vox)};
  for (const Touched& solid : solids_) {
    subjects.push_back({solid.shape.name,
                        {{solid.shape, volume_of(solid.shape, side_mm, voxel_mm, ramp_vox),
                          solid.contacts, std::min(walks_, solid.contacts.size())}}});
  }
  return subjects;
}

}  // namespace kerf::accuracy
