// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include <glm/glm.hpp>

namespace kerf {

/// The eight corners, in world mm, of a box of any orientation that a picture should show.
using BoxCorners = std::array<glm::dvec3, 8>;

/// The paper's equation (1): window depth, 0 at the near and 1 at the far plane, of a point
/// `eye_mm` away along the view axis. Every renderer writes this, so that volumes, meshes and the
/// tool hide one another as they should.
[[nodiscard]] constexpr double window_depth(double eye_mm, double near_mm, double far_mm) noexcept {
  const double f = far_mm;
  const double n = near_mm;
  return ((f + n) / (f - n) - 2.0 * f * n / ((f - n) * eye_mm) + 1.0) / 2.0;
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
  /// Clip plane: of volumes only points with dot(shown, (x, y, z, 1)) >= 0 are drawn, in world mm;
  /// the normal has length 1. As it stands, everything is shown.
  glm::dvec4 shown{0.0, 0.0, 0.0, 1.0};

  [[nodiscard]] glm::dmat4 clip_from_eye() const;
  friend bool operator==(const View&, const View&) = default;
};

/// Turns about a point. Yaw 0 looks from +z (the user); pitch is the height above the horizon.
class OrbitCamera {
 public:
  /// Shows what is in one or more boxes, by all their corners, from above and in front, in a
  /// picture of `aspect` (width over height).
  void frame(std::span<const glm::dvec3> corners, double aspect);

  /// Drags of the pointer, in fractions of the picture's height.
  void orbit(double right, double up);
  void pan(double right, double up);
  /// Steps of the wheel: positive is nearer, down to 1/50 and up to 20 times the radius of what is
  /// framed.
  void zoom(double steps);

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
};

}  // namespace kerf
