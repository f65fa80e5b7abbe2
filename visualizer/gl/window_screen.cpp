// SPDX-License-Identifier: Apache-2.0
// On which monitor a window is, and how large it is there.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <epoxy/gl.h>
// After the GL loader.
#include <GLFW/glfw3.h>

#include "visualizer/gl/window.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

std::vector<GLFWmonitor*> all_monitors() {
  int count = 0;
  GLFWmonitor** const first = glfwGetMonitors(&count);
  return {first, first + count};
}

/// On the desktop, from its upper left corner.
PixelRect area_of(GLFWmonitor* monitor) {
  int x = 0, y = 0;
  glfwGetMonitorPos(monitor, &x, &y);
  const GLFWvidmode* const mode = glfwGetVideoMode(monitor);
  return mode != nullptr ? PixelRect{x, y, x + mode->width, y + mode->height} : PixelRect{};
}

}  // namespace

std::size_t monitor_of(const PixelRect& window, std::span<const PixelRect> monitors) {
  std::size_t best = 0;
  std::int64_t most = 0;
  for (std::size_t i = 0; i < monitors.size(); ++i) {
    const std::int64_t shown = window.clipped(monitors[i]).area();
    if (shown <= most) continue;
    best = i;
    most = shown;
  }
  return best;
}

GLFWmonitor* Window::numbered_monitor(int number) {
  const std::vector<GLFWmonitor*> monitors = all_monitors();
  if (number >= 1 && static_cast<std::size_t>(number) <= monitors.size()) {
    return monitors[static_cast<std::size_t>(number) - 1];
  }
  std::string there;
  for (std::size_t i = 0; i < monitors.size(); ++i) {
    const PixelRect area = area_of(monitors[i]);
    there += (i > 0 ? ", " : "") + std::to_string(i + 1) + " (" + glfwGetMonitorName(monitors[i]) +
             ", " + std::to_string(area.x1 - area.x0) + "x" + std::to_string(area.y1 - area.y0) +
             ")";
  }
  throw VisualizerError("--monitor: " + std::to_string(number) + " is not there; " +
                        (there.empty() ? "this screen has none" : "take " + there));
}

void Window::fit(GLFWmonitor* monitor, bool moves) {
  if (monitor == nullptr) return;
  int x = 0, y = 0, wide = 0, high = 0, left = 0, top = 0, right = 0, bottom = 0;
  glfwGetMonitorWorkarea(monitor, &x, &y, &wide, &high);
  glfwGetWindowFrameSize(handle_, &left, &top, &right, &bottom);
  PictureSize now;
  glfwGetWindowSize(handle_, &now.width, &now.height);
  const PictureSize most{std::max(wide - left - right, 1), std::max(high - top - bottom, 1)};
  const PictureSize fits{std::min(now.width, most.width), std::min(now.height, most.height)};
  if (fits != now) glfwSetWindowSize(handle_, fits.width, fits.height);
  if (!moves) return;
  glfwSetWindowPos(handle_, x + left + (most.width - fits.width) / 2,
                   y + top + (most.height - fits.height) / 2);
}

void Window::fill(GLFWmonitor* monitor) {
  const GLFWvidmode* const mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
  if (mode == nullptr) return;
  int x = 0, y = 0, wide = 0, high = 0;
  glfwGetWindowPos(handle_, &x, &y);
  glfwGetWindowSize(handle_, &wide, &high);
  before_ = {x, y, x + wide, y + high};
  full_screen_ = true;
  glfwSetWindowMonitor(handle_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

void Window::leave_full_screen() {
  full_screen_ = false;
  glfwSetWindowMonitor(handle_, nullptr, before_.x0, before_.y0, before_.x1 - before_.x0,
                       before_.y1 - before_.y0, GLFW_DONT_CARE);
}

void Window::set_full_screen(bool full) {
  if (full == full_screen_) return;
  if (!full) return leave_full_screen();
  const std::vector<GLFWmonitor*> monitors = all_monitors();
  if (monitors.empty()) return;
  std::vector<PixelRect> areas;
  for (GLFWmonitor* const monitor : monitors) areas.push_back(area_of(monitor));
  int x = 0, y = 0, wide = 0, high = 0;
  glfwGetWindowPos(handle_, &x, &y);
  glfwGetWindowSize(handle_, &wide, &high);
  fill(monitors[monitor_of({x, y, x + wide, y + high}, areas)]);
}

void Window::follow_screen() {
  if (std::exchange(f11_, false)) set_full_screen(!full_screen_);
  if (full_screen_ && glfwGetWindowMonitor(handle_) == nullptr) {  // unplugged
    leave_full_screen();
    fit(glfwGetPrimaryMonitor(), true);
  }
  if (!std::exchange(moved_, false) || !cursor_known_) return;
  glfwGetCursorPos(handle_, &cursor_x_, &cursor_y_);
}

}  // namespace kerf
