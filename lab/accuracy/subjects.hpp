// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "lab/accuracy/analytic_shapes.hpp"

namespace kerf::accuracy {

/// The ball at a place where it dips into a shape.
struct Contact {
  Point centre_mm;
  double depth_mm;
  Point normal;  ///< of the shape's face below the centre
  Point force;   ///< by theory, over p0 pi R^2
};

/// What an ideally sampled ball feels of the shape with sharp faces, over p0 pi R^2: by the
/// divergence theorem, F = -p0 SURFINT rho n dA over the ball's surface. Summed over 100 000
/// points; within 1e-4.
[[nodiscard]] Point ideal_force(const Shape& shape, Point centre_mm, double radius_mm);

/// The contact of a given depth that is reached from `start_mm` along the normals; nothing where
/// there is none, as between two faces.
[[nodiscard]] std::optional<Contact> contact_on(const Shape& shape, Point start_mm, double depth_mm,
                                                double radius_mm);

/// `count` contacts spread over the shape's faces within `reach_mm` of (0, 0, 0) and evenly over
/// depths up to one radius.
[[nodiscard]] std::vector<Contact> contacts_on(const Shape& shape, std::size_t count,
                                               double radius_mm, double reach_mm);

/// One shape in voxels and where the tool touches it.
struct ContactCase {
  Shape shape;
  AnalyticVolume volume;
  std::vector<Contact> contacts;
  std::size_t walks;  ///< from so many of them, the first ones, also short ways are walked
};

inline constexpr double kVoxelMm = 0.125;  ///< of the standard
inline constexpr double kToolMm = 0.625;   ///< radius of the ball tool: 5 such voxels

/// A shape of the study: one volume, or one for each tilt of the plane.
struct Subject {
  std::string name;
  std::vector<ContactCase> cases;
};

/// Plane at many tilts, ball, torus, thin plate, crease, layered ball, and where the tool touches
/// them. The places are the same in mm, whatever the voxels, so they are found once.
class Subjects {
 public:
  /// `contacts` of each shape, and tilts of the plane; `walks` from the first of them.
  Subjects(std::size_t contacts, std::size_t walks);

  /// In cubes of `side_mm`; the planes have smaller ones.
  [[nodiscard]] std::vector<Subject> in_voxels(double voxel_mm, double side_mm) const;

 private:
  struct Touched {
    Shape shape;
    std::vector<Contact> contacts;
  };

  std::size_t walks_;
  std::vector<Touched> planes_, solids_;
};

}  // namespace kerf::accuracy
