// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"

/// Shapes by signed distance, their volumes, and contacts of a ball on them: the truth of an
/// accuracy study. mm.
namespace kerf::accuracy {

using Point = WorldVec<double>;  ///< mm

/// Of length 1; `v` is not zero.
[[nodiscard]] inline Point unit(Point v) {
  return v * (1 / norm(v));
}

/// A solid by its signed distance: negative inside, of slope one near the face.
struct Layer {
  std::function<double(Point)> distance_mm;
  double density;  ///< 0..1, added to that of the other layers
};

/// A shape as an ideal scanner sees it. The first layer encloses the others.
struct Shape {
  std::string name;
  std::vector<Layer> layers;

  [[nodiscard]] double distance_mm(Point at) const { return layers.front().distance_mm(at); }
  /// Outward normal of the outer face nearest to `at`.
  [[nodiscard]] Point normal(Point at) const;
  /// 0..1; each face is a ramp of `edge_mm` across, clip(0.5 - distance / edge, 0, 1).
  [[nodiscard]] double density(Point at, double edge_mm) const;
};

[[nodiscard]] Shape plane(Point normal, double offset_mm);  ///< solid below; `normal` of any length
[[nodiscard]] Shape ball(Point centre, double radius_mm);
[[nodiscard]] Shape torus(Point axis, double ring_mm, double tube_mm);
[[nodiscard]] Shape thin_plate(Point normal, double thickness_mm);
[[nodiscard]] Shape crease();  ///< a groove of 90 degrees between two tilted flats
/// Enamel of full density around a dentin of 0.6.
[[nodiscard]] Shape layered_ball(Point centre, double radius_mm, double enamel_mm);

/// A shape in voxels, antialiased over some voxel edges. The point (0, 0, 0) mm is the centre of
/// the voxel with index n / 2 along each axis.
struct AnalyticVolume {
  VoxelGrid grid;
  double voxel_mm;
  std::vector<Density> density;

  [[nodiscard]] VoxelVec<double> voxel_from_mm(Point at) const noexcept;
  [[nodiscard]] Point mm_from_voxel(VoxelVec<double> at) const noexcept;
};

/// A cube of `side_mm` around (0, 0, 0); faces are ramps over `ramp_vox`.
[[nodiscard]] AnalyticVolume volume_of(const Shape& shape, double side_mm, double voxel_mm,
                                       double ramp_vox = 1);

/// The `i`-th of `count` directions that cover the sphere evenly (Fibonacci lattice).
[[nodiscard]] Point spread_direction(std::size_t i, std::size_t count);
/// The `i`-th point of an even cover of the cube from -1 to 1 (Halton sequence, bases 2, 3, 5).
[[nodiscard]] Point spread_place(std::size_t i);

/// The ball at a position in which it dips into a shape.
struct Contact {
  Point centre_mm;
  double depth_mm;
  Point normal;  ///< of the shape's face below the centre
  Point force;   ///< by theory, over p0 pi R^2
};

/// The force on an ideally sampled ball of the shape with sharp faces, over p0 pi R^2: by the
/// divergence theorem, F = -p0 SURFINT rho n dA over the ball's surface. Summed over 100 000
/// points; within 1e-4.
[[nodiscard]] Point ideal_force(const Shape& shape, Point centre_mm, double radius_mm);

/// The contact of a given depth that is reached from `start_mm` along the normals; empty if there
/// is none, as between two faces.
[[nodiscard]] std::optional<Contact> contact_on(const Shape& shape, Point start_mm, double depth_mm,
                                                double radius_mm);

/// `count` contacts spread over the shape's faces within `reach_mm` of (0, 0, 0) and evenly over
/// depths up to one radius.
[[nodiscard]] std::vector<Contact> contacts_on(const Shape& shape, std::size_t count,
                                               double radius_mm, double reach_mm);

/// One shape in voxels and the contacts of the tool.
struct ContactCase {
  Shape shape;
  AnalyticVolume volume;
  std::vector<Contact> contacts;
  std::size_t walks;  ///< the first so many of them also begin short paths
};

inline constexpr double kVoxelMm = 0.125;  ///< of the standard
inline constexpr double kToolMm = 0.625;   ///< radius of the ball tool: 5 such voxels

/// A shape of the study: one volume, or one for each tilt of the plane.
struct TestShape {
  std::string name;
  std::vector<ContactCase> cases;
};

/// Plane at many tilts, ball, torus, thin plate, crease, layered ball, and the contacts of the tool
/// on them. Contacts are the same in mm for all voxels, so they are found once.
class Subjects {
 public:
  /// `contacts` of each shape, and tilts of the plane; `walks` from the first of them.
  Subjects(std::size_t contacts, std::size_t walks);

  /// In cubes of `side_mm`; the planes have smaller ones. Faces are ramps over `ramp_vox`.
  [[nodiscard]] std::vector<TestShape> in_voxels(double voxel_mm, double side_mm,
                                                 double ramp_vox = 1) const;
  /// The planes alone.
  [[nodiscard]] TestShape planes_in_voxels(double voxel_mm, double side_mm,
                                           double ramp_vox = 1) const;

 private:
  struct Touched {
    Shape shape;
    std::vector<Contact> contacts;
  };

  std::size_t walks_;
  std::vector<Touched> planes_, solids_;
};

}  // namespace kerf::accuracy
