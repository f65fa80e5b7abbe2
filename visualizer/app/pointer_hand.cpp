// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/pointer_hand.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

/// The point moved away from the eye by so many mm along the view axis, on its ray.
SeenPoint deeper(const SeenPoint& seen, double by_mm, double least_mm, double most_mm) {
  return {seen.pixel, std::clamp(seen.depth_mm + by_mm, least_mm, std::max(least_mm, most_mm))};
}

}  // namespace

void PointerHand::step(const WindowInput& input, bool over_panel, const View& view,
                       PictureSize size, const glm::dvec3& tool_mm, const DeviceFrame& device,
                       double frame_s) {
  const bool points = input.hovers && !over_panel;
  const HeldControls& held = input.held;
  by_pad_ = held.by_pad || (by_pad_ && !input.hovers);
  leads_ = input.hovers || by_pad_;
  const SeenPoint tool = seen_at(view, size, tool_mm);
  if (tool.depth_mm <= 0.0) return;  // nobody leads what is behind him
  const bool acts = input.free_right != 0.0 || input.free_up != 0.0 || input.wheel != 0.0 ||
                    input.pointer.down || held.deeper != 0.0;
  if (!goal_mm_ && ((points && acts) || held.by_pad)) goal_mm_ = tool_mm;
  if (!goal_mm_) return;
  SeenPoint seen = seen_at(view, size, *goal_mm_);
  if (seen.depth_mm <= 0.0) seen = tool;
  const double scale = device.scale;
  const double held_mm = kHeldMmPerS * scale * frame_s;
  const double mm_per_pixel = 2.0 * view.tan_half_height * seen.depth_mm / size.height;
  seen.pixel += glm::dvec2(held.right, -held.up) * (held_mm / mm_per_pixel);
  if (points && !under_pointer_) {
    seen.pixel = {input.pointer.x, input.pointer.y};
  } else if (points) {
    seen.pixel += glm::dvec2(input.free_right + input.drag_right, -input.free_up - input.drag_up) *
                  static_cast<double>(size.height);
  }
  under_pointer_ = points;
  const double by_mm = (points ? input.wheel * kWheelMm * scale : 0.0) + held.deeper * held_mm;
  const double least_mm = 2.0 * view.near_mm;
  const double most_mm = std::max(seen.depth_mm, tool.depth_mm + kMostAheadMm * scale);
  seen = deeper(seen, by_mm, least_mm, most_mm);
  goal_mm_ = world_at(view, size, seen);
  const bool presses = (points && input.pointer.down) || held.press;
  const glm::dvec3 eye_mm(glm::inverse(view.eye_from_world)[3]);
  press_mm_ = presses ? glm::normalize(*goal_mm_ - eye_mm) * (kPressMm * scale) : glm::dvec3(0.0);
  const glm::dvec2 turned = glm::dvec2(held.tilt_right, held.tilt_up) * (kHeldRadPerS * frame_s);
  tilt_rad_ = glm::clamp(tilt_rad_ + turned, -kMaxWishRad, kMaxWishRad);
}

std::optional<glm::dvec3> PointerHand::goal_mm() const {
  if (!goal_mm_) return std::nullopt;
  return *goal_mm_ + press_mm_;
}

HandWish PointerHand::wish(const DeviceFrame& device) const {
  const glm::dvec3 at = (goal_mm().value_or(device.offset_mm) - device.offset_mm) / device.scale;
  return {.tip_mm = {at.x, at.y, at.z}, .orientation_rad = {tilt_rad_.x, tilt_rad_.y, 0.0}};
}

}  // namespace kerf
