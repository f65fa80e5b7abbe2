// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "controller/tool/tool_mesh.hpp"
#include "controller/tool/tool_shapes.hpp"

// The surface samples of any tool, for contact, and the dense ones that refine a contact.

namespace kerf {

/// A sample of a tool's surface, in the tool's axes.
struct SurfaceSample {
  std::array<double, 3> at;  ///< from the tool's centre
  std::array<double, 3>
      normal;  ///< outward, of length 1; 0 on a rim or a point, where it is not unique
};

/// Distances of the surface samples, in edges of the finest voxel. Contact needs them evenly
/// spread, and no farther apart than the width of a density's edge.
///
/// The touching cap of a ball has an area that grows with the radius, so the same number of samples
/// is enough if their distance grows with the root of it: a ball of 8 gets 805, of 31.5 gets 7981.
/// (With 515 for a radius of 8 the worst normal on a ball of 6 is 0.6 degrees off instead of 0.25.)
[[nodiscard]] inline double ball_sample_pitch(double radius_units) {
  return std::clamp(std::sqrt(radius_units / 8), 1.0, 1.25);
}
inline constexpr double kShapeSamplePitch = 1.0;

/// Only a part of the surface touches: the pitch of a small tool shrinks until there are so many.
inline constexpr int kMinSurfaceSamples = 512;

/// A query reads each sample, which takes some 2 ns of the tick.
inline constexpr int kMaxSurfaceSamples = 8000;

/// Most samples of a part behind the head. One that would have more gets a wider pitch, up to
/// kWidestPartPitch. The dense samples find its contacts as exactly as those of a head, but a point
/// or a loose piece of material that is narrower than the pitch may be missed.
inline constexpr int kMostPartSamples = 2048;
inline constexpr double kWidestPartPitch = 4;

/// No part reaches farther from the tool's centre, in units: in a tick of 1 ms the sweep turns the
/// tool by 12 steps of 0.875 / reach, which is then 10 rad/s, as fast as a hand.
inline constexpr double kMostReach = 1024;

/// Samples of a tool's surface, ends and rims included, in mm from its centre along its axes. Each
/// has the same area to itself, and no grid line meets many of them. Load time.
///
/// A mesh gets those of `mesh_surface_samples`, a ball the Fibonacci points. The other shapes, all
/// solids of revolution, get rings at even distances along their profile, each turned by the golden
/// angle from the one before. The last ring before a rim lies 0.05 distances from it. That is
/// tuned: on tilted planes a cylinder of radius 5 and length 16 then rests 0.004 voxels too low in
/// the mean; with a ring on the rim itself 0.03 too high, with rings 0.15 and 0.85 distances from
/// it 0.07 too low. A point gets a sample of its own: a sum over a few rings cannot show how far it
/// reaches.
///
/// Throws LoadError above kMaxSurfaceSamples.
[[nodiscard]] std::vector<std::array<double, 3>> surface_samples(const SceneTool& tool,
                                                                 double unit_mm);

/// Samples kClosePitch units apart of a tool that is not a ball, made in the same way, to refine a
/// contact. None for a ball. Load time.
[[nodiscard]] std::vector<SurfaceSample> close_samples(const SceneTool& tool, double unit_mm);

/// How far a mesh reaches beyond its close samples, in mm: the largest difference of the two
/// supports (the farthest point along a direction) over 1500 directions. A depth that is read at
/// the samples is that much less than the mesh's, at most. 0 without triangles: the other shapes
/// have samples on their rims and points. Load time: 20 ms for 10,000 samples.
[[nodiscard]] double support_deficit_mm(const ToolMesh& mesh, std::span<const SurfaceSample> close);

/// Both for a part behind the head of `tool`, in mm from the middle of the part.
/// Throws LoadError for a part that is too large or too long for its unit. Load time.
struct PartSamples {
  std::vector<std::array<double, 3>> samples;
  std::vector<SurfaceSample> close;
};
[[nodiscard]] PartSamples part_samples(const SceneTool& tool, const ToolPart& part, double unit_mm);

// Samples of the surface of a mesh, evenly spread.

/// Area of all triangles.
[[nodiscard]] double surface_mm2(const ToolMesh& mesh);

/// Effort for an even distribution: dots per sample that represent the surface, and rounds of the
/// relaxation that moves the samples.
struct Relaxation {
  std::size_t dots;
  int rounds;
};
inline constexpr Relaxation kEven{
    32, 24};  ///< later rounds move them by less than 1 % of their distance
inline constexpr Relaxation kNearlyEven{12, 8};  ///< takes a sixth of the time

/// Some `count` samples of a mesh, each with the same area to itself: those of its rims and points,
/// and between them others that Lloyd's relaxation moves to the middle of their nearest surface.
/// Faces with opposite normals are separate, so that a thin blade has samples on both of
/// its sides. The same mesh gives the same samples. Load time: 0.1 s for 1000 that are kEven.
[[nodiscard]] std::vector<SurfaceSample> mesh_surface_samples(const ToolMesh& mesh,
                                                              std::size_t count,
                                                              Relaxation relaxation = kEven);

}  // namespace kerf
