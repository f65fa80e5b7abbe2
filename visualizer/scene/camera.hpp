// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <glm/glm.hpp>

#include "visualizer/scene/camera_pose.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// The eight corners, in world mm, of a box of any orientation that a picture should show.
using BoxCorners = std::array<glm::dvec3, 8>;

/// Corners of the box from `low` to `high` that stands at `pose`; bit 0 of the index: high x, bit
/// 1: high y, bit 2: high z.
[[nodiscard]] inline BoxCorners box_corners(const glm::dvec3& low, const glm::dvec3& high,
                                            const glm::dmat4& pose = glm::dmat4(1.0)) {
  BoxCorners corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec4 at((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                        (i & 4) != 0 ? high.z : low.z, 1.0);
    corners[i] = glm::dvec3(pose * at);
  }
  return corners;
}

/// What one picture is seen through. Eye space: x right, y up, the camera looks along -z, in mm.
struct View {
  glm::dmat4 eye_from_world{1.0};
  double tan_half_height = 0.25;  ///< half the picture's height at 1 mm from the eye, in mm
  double aspect = 1.0;            ///< width over height
  /// The picture's middle, 1 mm from the eye, lies this far to the right of the view axis, in mm:
  /// not 0 for an eye that looks straight ahead through a window beside it.
  double middle_right = 0.0;
  double near_mm = 1.0;
  double far_mm = 100.0;
  /// Of volumes only points with dot(clip_plane, (x, y, z, 1)) >= 0 are drawn, in world mm; the
  /// normal has length 1. By default everything is drawn.
  glm::dvec4 clip_plane{0.0, 0.0, 0.0, 1.0};

  [[nodiscard]] glm::dmat4 clip_from_eye() const;
  friend bool operator==(const View&, const View&) = default;
};

/// Turns about a point. Yaw 0 looks from +z (the user); pitch is the height above the horizon.
/// World y is upright in the picture unless a pose has rolled it.
class OrbitCamera {
 public:
  /// Shows what is in one or more boxes, by all their corners, from above and in front, in a
  /// picture of `aspect` (width over height).
  void frame(std::span<const glm::dvec3> corners, double aspect);

  /// From a pose that has no `problem_with`; near and far go on from what was framed.
  void look(const CameraPose& pose);
  /// The present one; `up` is of length 1 and square to the view.
  [[nodiscard]] CameraPose pose() const;

  /// Drags of the pointer, in fractions of the picture's height.
  void orbit(double right, double up);
  /// Orbits about a point in world mm, which keeps its position in the picture.
  void orbit_about(const glm::dvec3& pivot_mm, double right, double up);
  void pan(double right, double up);
  /// Steps of the wheel: positive is nearer, down to 1/50 and up to 20 times the radius of what is
  /// framed. A pose may lie beyond: from there no farther.
  void zoom(double steps);
  /// Zooms about a point in world mm, which keeps its position in the picture.
  void zoom_about(const glm::dvec3& pivot_mm, double steps);

  /// The near and far planes hold all that is within `reach_mm` of the centre of what is framed:
  /// the middle of the box around it.
  [[nodiscard]] View view(double aspect, double reach_mm) const;
  /// From that centre to the farthest corner.
  [[nodiscard]] double radius_mm() const noexcept { return radius_mm_; }
  /// From the eye to the point that it turns about.
  [[nodiscard]] double distance_mm() const noexcept { return distance_mm_; }

 private:
  [[nodiscard]] glm::dmat3 eye_axes() const;  ///< rows: right, up, backward in world axes

  glm::dvec3 centre_mm_{0, 0, 0};  ///< of what is framed
  double radius_mm_ = 1.0;
  glm::dvec3 target_mm_{0, 0, 0};
  double distance_mm_ = 4.0;
  double yaw_rad_ = 0.0;
  double pitch_rad_ = 0.0;
  double roll_rad_ = 0.0;  ///< of the picture about its middle, counter-clockwise as it is seen
};

/// Where a point in world mm is seen: in pixels of a picture from its upper left corner, and how
/// far from the eye along the view axis, in mm.
struct SeenPoint {
  glm::dvec2 pixel{0.0};
  double depth_mm = 0.0;  ///< not positive: behind the eye, and `pixel` means nothing
};
[[nodiscard]] SeenPoint seen_at(const View& view, PictureSize size, const glm::dvec3& world_mm);
/// The inverse of `seen_at`.
[[nodiscard]] glm::dvec3 world_at(const View& view, PictureSize size, const SeenPoint& seen);

/// Pixels of a picture that what lies within the hull of `corners` can cover; all of them if a
/// corner is not in front of the near plane.
[[nodiscard]] PixelRect screen_bounds(std::span<const glm::dvec3> corners, const View& view,
                                      PictureSize size);

/// Two eyes before one window: parallel view axes and asymmetric frusta whose middles meet at the
/// convergence distance. Eyes that toe in would shift things up and down against each other in the
/// corners, which hurts (P. Bourke, "Calculating stereo pairs", 1999; A. Woods, T. Docherty and
/// R. Koch, "Image distortions in stereoscopic video systems", 1993).
///
/// A point at distance z is seen by the left eye farther right than by the right one by
///
///     eyes_mm (1 / z - 1 / convergence_mm) / (tan_half_height aspect)
///
/// half widths of the picture: 0 at the convergence distance, which is that of the screen.
struct StereoBase {
  double eyes_mm;         ///< between the eyes; negative: crossed, for pictures seen cross-eyed
  double convergence_mm;  ///< from the eyes to what seems to lie in the screen; positive
};

/// The left and the right eye on either side of `middle`.
[[nodiscard]] std::array<View, 2> eye_views(const View& middle, const StereoBase& base);

/// Eyes that lie a thirtieth of the convergence distance apart: 65 mm at two metres, as if the
/// tooth had the size of a person. The photographers' rule; what is a quarter nearer or farther
/// than the screen then stays within 0.7 degrees of it, where eyes can rest.
inline constexpr double kEyesPerConvergence = 1.0 / 30.0;

}  // namespace kerf
