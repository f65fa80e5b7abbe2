// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kerf {

namespace {

constexpr double kHalfHeightRad = 14.0 * std::numbers::pi / 180.0;  // a portrait lens: little warp
// Over the front right shoulder: the crown, where the bur works, and the side are both in view.
constexpr double kHomeYawRad = 25.0 * std::numbers::pi / 180.0;
constexpr double kHomePitchRad = 54.0 * std::numbers::pi / 180.0;
constexpr double kMaxPitchRad = 89.0 * std::numbers::pi / 180.0;  // `up` keeps a meaning
constexpr double kDragRad = std::numbers::pi;                     // a full drag is half a turn
constexpr double kZoomStep = 0.9;
constexpr double kMargin = 0.86;   // what is in a box seldom reaches its corners
constexpr double kNearest = 0.02;  // distance limits and near plane, in radii
constexpr double kFarthest = 20.0;
constexpr double kNearPlane = 0.01;

View beside(const View& middle, double right_mm, double convergence_mm) {
  View eye = middle;
  eye.eye_from_world[3].x -= right_mm;
  eye.middle_right = middle.middle_right - right_mm / convergence_mm;
  return eye;
}

}  // namespace

glm::dmat4 View::clip_from_eye() const {
  const double f = far_mm;
  const double n = near_mm;
  glm::dmat4 m(0.0);
  m[0][0] = 1.0 / (tan_half_height * aspect);
  m[1][1] = 1.0 / tan_half_height;
  m[2][0] = middle_right / (tan_half_height * aspect);
  m[2][2] = -(f + n) / (f - n);
  m[2][3] = -1.0;
  m[3][2] = -2.0 * f * n / (f - n);
  return m;
}

void OrbitCamera::frame(std::span<const glm::dvec3> corners, double aspect) {
  glm::dvec3 low = corners.front();
  glm::dvec3 high = low;
  for (const glm::dvec3& corner : corners) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  }
  centre_mm_ = 0.5 * (low + high);
  target_mm_ = centre_mm_;
  radius_mm_ = 0.0;
  yaw_rad_ = kHomeYawRad;
  pitch_rad_ = kHomePitchRad;
  roll_rad_ = 0.0;
  distance_mm_ = 0.0;
  const double half = std::tan(kHalfHeightRad) / kMargin;
  const glm::dmat3 axes = eye_axes();
  for (const glm::dvec3& corner : corners) {
    radius_mm_ = std::max(radius_mm_, glm::length(corner - centre_mm_));
    const glm::dvec3 at = axes * (corner - centre_mm_);
    const double needed =
        std::max(std::abs(at.x) / std::max(aspect, 1.0), std::abs(at.y) * std::min(aspect, 1.0));
    distance_mm_ = std::max(distance_mm_, at.z + needed / half);
  }
}

void OrbitCamera::look(const CameraPose& pose) {
  constexpr double kUpright = 1e-9;  // the horizontal part of a view from which yaw is known
  const glm::dvec3 away = pose.eye_mm - pose.target_mm;
  const glm::dvec3 backward = glm::normalize(away);
  const glm::dvec3 level = std::hypot(backward.x, backward.z) > kUpright ? backward
                           : backward.y > 0.0                            ? -pose.up
                                                                         : pose.up;
  target_mm_ = pose.target_mm;
  distance_mm_ = glm::length(away);
  yaw_rad_ = std::atan2(level.x, level.z);
  pitch_rad_ = std::asin(std::clamp(backward.y, -1.0, 1.0));
  roll_rad_ = 0.0;
  const glm::dvec3 up = eye_axes() * pose.up;
  roll_rad_ = std::atan2(-up.x, up.y);
}

CameraPose OrbitCamera::pose() const {
  const glm::dmat3 axes = eye_axes();
  return {target_mm_ + glm::dvec3(0.0, 0.0, distance_mm_) * axes, target_mm_,
          glm::dvec3(0.0, 1.0, 0.0) * axes};
}

void OrbitCamera::orbit(double right, double up) {
  const double sine = std::sin(roll_rad_), cosine = std::cos(roll_rad_);
  const double level = cosine * right - sine * up;
  up = sine * right + cosine * up;
  right = level;
  yaw_rad_ = std::remainder(yaw_rad_ - right * kDragRad, 2.0 * std::numbers::pi);
  pitch_rad_ = std::clamp(pitch_rad_ - up * kDragRad, -kMaxPitchRad, kMaxPitchRad);
}

void OrbitCamera::orbit_about(const glm::dvec3& pivot_mm, double right, double up) {
  const glm::dvec3 seen = eye_axes() * (pivot_mm - target_mm_);
  orbit(right, up);
  target_mm_ = pivot_mm - seen * eye_axes();
}

void OrbitCamera::pan(double right, double up) {
  const double mm = 2.0 * distance_mm_ * std::tan(kHalfHeightRad);  // height of the picture there
  target_mm_ -= mm * (glm::dvec3(right, up, 0.0) * eye_axes());
}

void OrbitCamera::zoom(double steps) {
  distance_mm_ = std::clamp(distance_mm_ * std::pow(kZoomStep, steps),
                            std::min(kNearest * radius_mm_, distance_mm_),
                            std::max(kFarthest * radius_mm_, distance_mm_));
}

void OrbitCamera::zoom_about(const glm::dvec3& pivot_mm, double steps) {
  const double before_mm = distance_mm_;
  zoom(steps);
  target_mm_ = pivot_mm + (target_mm_ - pivot_mm) * (distance_mm_ / before_mm);
}

glm::dmat3 OrbitCamera::eye_axes() const {
  const glm::dvec3 backward{std::cos(pitch_rad_) * std::sin(yaw_rad_), std::sin(pitch_rad_),
                            std::cos(pitch_rad_) * std::cos(yaw_rad_)};
  const glm::dvec3 level{std::cos(yaw_rad_), 0.0, -std::sin(yaw_rad_)};
  const glm::dvec3 upright = glm::cross(backward, level);
  const double sine = std::sin(roll_rad_), cosine = std::cos(roll_rad_);
  return glm::transpose(
      glm::dmat3(cosine * level + sine * upright, cosine * upright - sine * level, backward));
}

View OrbitCamera::view(double aspect, double reach_mm) const {
  const glm::dmat3 axes = eye_axes();
  const glm::dvec3 eye_mm = target_mm_ + glm::dvec3(0.0, 0.0, distance_mm_) * axes;
  View view;
  view.eye_from_world = glm::dmat4(axes);
  view.eye_from_world[3] = glm::dvec4(-(axes * eye_mm), 1.0);
  view.aspect = aspect;
  // A picture higher than wide shows the same sphere: the lens opens, the camera stays.
  view.tan_half_height = std::tan(kHalfHeightRad) / std::min(1.0, aspect);
  const double centre_mm = glm::length(eye_mm - centre_mm_);
  view.near_mm = std::max(centre_mm - reach_mm, kNearPlane * radius_mm_);
  view.far_mm = std::max(centre_mm + reach_mm, 2.0 * view.near_mm);
  return view;
}

SeenPoint seen_at(const View& view, PictureSize size, const glm::dvec3& world_mm) {
  const glm::dvec3 eye(view.eye_from_world * glm::dvec4(world_mm, 1.0));
  const double depth_mm = -eye.z;
  if (!(depth_mm > 0.0)) return {};
  const double across = view.tan_half_height * depth_mm;
  const double right = (eye.x - view.middle_right * depth_mm) / (across * view.aspect);
  return {{(1.0 + right) / 2.0 * size.width, (1.0 - eye.y / across) / 2.0 * size.height}, depth_mm};
}

glm::dvec3 world_at(const View& view, PictureSize size, const SeenPoint& seen) {
  const double across = view.tan_half_height * seen.depth_mm;
  const double right = 2.0 * seen.pixel.x / size.width - 1.0;
  const double up = 1.0 - 2.0 * seen.pixel.y / size.height;
  const glm::dvec4 eye(right * across * view.aspect + view.middle_right * seen.depth_mm,
                       up * across, -seen.depth_mm, 1.0);
  return glm::dvec3(glm::inverse(view.eye_from_world) * eye);
}

PixelRect screen_bounds(std::span<const glm::dvec3> corners, const View& view, PictureSize size) {
  const PixelRect all{0, 0, size.width, size.height};
  constexpr double kFar = std::numeric_limits<double>::infinity();
  double x0 = kFar, y0 = kFar, x1 = -kFar, y1 = -kFar;
  for (const glm::dvec3& corner : corners) {
    const glm::dvec3 eye(view.eye_from_world * glm::dvec4(corner, 1.0));
    const double depth_mm = -eye.z;
    if (!(depth_mm > view.near_mm)) return all;
    const double up = eye.y / (depth_mm * view.tan_half_height);
    const double right =
        (eye.x / depth_mm - view.middle_right) / (view.tan_half_height * view.aspect);
    x0 = std::min(x0, right);
    x1 = std::max(x1, right);
    y0 = std::min(y0, up);
    y1 = std::max(y1, up);
  }
  const auto pixel = [](double ndc, int pixels) {
    return std::clamp((ndc + 1.0) / 2.0 * pixels, -1.0, pixels + 1.0);
  };
  constexpr int kRounding = 1;
  const PixelRect bounds{static_cast<int>(std::floor(pixel(x0, size.width))),
                         static_cast<int>(std::floor(pixel(y0, size.height))),
                         static_cast<int>(std::ceil(pixel(x1, size.width))),
                         static_cast<int>(std::ceil(pixel(y1, size.height)))};
  return bounds.grown(kRounding).clipped(all);
}

std::array<View, 2> eye_views(const View& middle, const StereoBase& base) {
  const double half_mm = 0.5 * base.eyes_mm;
  return {beside(middle, -half_mm, base.convergence_mm),
          beside(middle, half_mm, base.convergence_mm)};
}

}  // namespace kerf
