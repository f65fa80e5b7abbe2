// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "lab/accuracy/contact_case.hpp"

namespace kerf::accuracy {

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
