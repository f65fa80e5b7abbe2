// SPDX-License-Identifier: Apache-2.0
#include "visualizer/gl/window.hpp"

#include <epoxy/gl.h>
#include <epoxy/glx.h>
// After the GL loader.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <GLFW/glfw3.h>
#include <X11/Xlib.h>

#include "visualizer/scene/visualizer_error.hpp"

// A GLFW that is built for Wayland alone lacks them.
// NOLINTBEGIN(readability-identifier-naming): the names are GLFW's.
extern "C" __attribute__((weak)) Display* glfwGetX11Display();
extern "C" __attribute__((weak)) ::Window glfwGetX11Window(GLFWwindow* handle);
// NOLINTEND(readability-identifier-naming)

namespace kerf {

namespace {

[[noreturn]] void fail(const char* what) {
  const char* reason = nullptr;
  glfwGetError(&reason);
  throw VisualizerError(std::string("window: ") + what + " (" +
                        (reason != nullptr ? reason : "no reason given") +
                        "); use --headless --out DIR for pictures without a screen");
}

Window& window_of(GLFWwindow* handle) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(handle));
}

bool g_screen_is_gone = false;

/// Xlib would print two lines of its own and end the process, wherever that stands. Without them
/// its calls fail from then on, and `Window::poll` has the word.
void outlive_the_screen() {
  Display* const display = glfwGetX11Display != nullptr ? glfwGetX11Display() : nullptr;
  if (display == nullptr) return;  // a screen without X
  XSetIOErrorHandler([](Display*) { return 0; });
  XSetIOErrorExitHandler(
      display, [](Display*, void*) { g_screen_is_gone = true; }, nullptr);
}

/// By the interface that the screen's system has by itself (GLX in X), or, where that has no
/// context, by EGL: some remote desktops have no GLX. The context is current.
GLFWwindow* make_window(PictureSize size) {
  constexpr std::array kInterfaces{GLFW_NATIVE_CONTEXT_API, GLFW_EGL_CONTEXT_API};
  const auto make = [&] {
    GLFWwindow* const made = glfwCreateWindow(size.width, size.height, "kerf", nullptr, nullptr);
    if (made != nullptr) glfwMakeContextCurrent(made);
    return made;
  };
  std::string found;
  const auto reject = [&](GLFWwindow* made, const std::string& missing) {
    found = found_gl(missing);
    glfwDestroyWindow(made);
  };
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  for (const GlVersion version : kAskedVersions) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, version.major);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, version.minor);
    for (const int interface : kInterfaces) {
      glfwWindowHint(GLFW_CONTEXT_CREATION_API, interface);
      GLFWwindow* const made = make();
      if (made == nullptr) continue;
      const std::string missing = missing_extensions();
      if (missing.empty()) return made;
      reject(made, missing);
    }
  }
  // Whatever there is: its version is the user's answer.
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_ANY_PROFILE);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 1);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
  for (const int interface : kInterfaces) {
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, interface);
    if (!found.empty()) break;
    if (GLFWwindow* const made = make()) reject(made, {});
  }
  if (!found.empty()) throw VisualizerError(gl_is_too_old("window", found));
  fail("neither GLX nor EGL has an OpenGL context");
}

/// A lower-case letter or a digit: what is printed on the key, or, if that is another sign (of
/// other scripts, or the upper row of a French keyboard), what an American one has in its place. 0
/// for any other key.
char letter_of(int key, int scancode) {
  const char* const printed = glfwGetKeyName(key, scancode);
  if (printed != nullptr && printed[0] != '\0' && printed[1] == '\0') {
    const char sign = printed[0];
    if ((sign >= 'a' && sign <= 'z') || (sign >= '0' && sign <= '9')) return sign;
    if (sign >= 'A' && sign <= 'Z') return static_cast<char>(sign - 'A' + 'a');
  }
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z) return static_cast<char>('a' + (key - GLFW_KEY_A));
  if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9) return static_cast<char>('0' + (key - GLFW_KEY_0));
  return '\0';
}

bool has_shift(GLFWwindow* handle) {
  return glfwGetKey(handle, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
         glfwGetKey(handle, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
}

/// -1, 0 or 1 by two keys.
double of_keys(GLFWwindow* handle, int less, int more) {
  return (glfwGetKey(handle, more) == GLFW_PRESS ? 1.0 : 0.0) -
         (glfwGetKey(handle, less) == GLFW_PRESS ? 1.0 : 0.0);
}

/// A stick that rests is seldom quite in its middle.
double of_axis(float value) {
  constexpr double kRests = 0.15;
  const double beyond = std::max(std::abs(static_cast<double>(value)) - kRests, 0.0) / (1 - kRests);
  return std::copysign(std::min(beyond, 1.0), value);
}

void add_gamepad(HeldControls& held) {
  GLFWgamepadstate pad;
  if (glfwGetGamepadState(GLFW_JOYSTICK_1, &pad) != GLFW_TRUE) return;
  const auto axis = [&](int name) { return of_axis(pad.axes[name]); };
  const auto pressed = [&](int name) { return pad.buttons[name] == GLFW_PRESS ? 1.0 : 0.0; };
  const HeldControls keys = held;
  held.right += axis(GLFW_GAMEPAD_AXIS_LEFT_X);
  held.up -= axis(GLFW_GAMEPAD_AXIS_LEFT_Y);  // down is positive
  held.deeper -= axis(GLFW_GAMEPAD_AXIS_RIGHT_Y);
  held.tilt_right +=
      pressed(GLFW_GAMEPAD_BUTTON_DPAD_RIGHT) - pressed(GLFW_GAMEPAD_BUTTON_DPAD_LEFT);
  held.tilt_up += pressed(GLFW_GAMEPAD_BUTTON_DPAD_UP) - pressed(GLFW_GAMEPAD_BUTTON_DPAD_DOWN);
  held.press = pressed(GLFW_GAMEPAD_BUTTON_A) + pressed(GLFW_GAMEPAD_BUTTON_RIGHT_BUMPER) > 0;
  held.by_pad = held.press || held.right != keys.right || held.up != keys.up ||
                held.deeper != keys.deeper || held.tilt_right != keys.tilt_right ||
                held.tilt_up != keys.tilt_up;
}

/// Whether parts of a picture may be copied to the window of the current context one by one, and
/// cost less than all of it: a software GL draws each pixel that it copies, and waits for no
/// refresh.
bool can_show_parts(GLFWwindow* handle) {
  Display* const display = glfwGetX11Display != nullptr ? glfwGetX11Display() : nullptr;
  if (display == nullptr) return false;
  if (glfwGetWindowAttrib(handle, GLFW_CONTEXT_CREATION_API) != GLFW_NATIVE_CONTEXT_API) {
    return false;
  }
  return query_gl_driver().software &&
         epoxy_has_glx_extension(display, DefaultScreen(display), "GLX_MESA_copy_sub_buffer");
}

/// Of a window of which `can_show_parts` is true: whether the screen gives it this size now.
bool has_size(GLFWwindow* handle, PictureSize size) {
  ::Window root = 0;
  int x = 0, y = 0;
  unsigned width = 0, height = 0, border = 0, depth = 0;
  const int found = XGetGeometry(glfwGetX11Display(), glfwGetX11Window(handle), &root, &x, &y,
                                 &width, &height, &border, &depth);
  return found != 0 && PictureSize{static_cast<int>(width), static_cast<int>(height)} == size;
}

/// Rectangles that cover `parts`. Each costs as much as so many pixels more (35 us by llvmpipe, of
/// which a pixel costs 4 to 5 ns), so two become one if that has no more than these.
std::vector<PixelRect> joined(std::span<const PixelRect> parts) {
  constexpr int kPixelsOfOne = 8000;
  std::vector<PixelRect> rects;
  for (PixelRect rect : parts) {
    const auto joins = [&](const PixelRect& other) {
      return rect.united(other).area() <= rect.area() + other.area() + kPixelsOfOne;
    };
    for (auto with = std::ranges::find_if(rects, joins); with != rects.end();
         with = std::ranges::find_if(rects, joins)) {
      rect = rect.united(*with);
      rects.erase(with);
    }
    rects.push_back(rect);
  }
  return rects;
}

}  // namespace

glm::dvec2 pixels_per_unit(PictureSize pixels, PictureSize units) noexcept {
  const auto along = [](int of_picture, int of_cursor) {
    return of_picture > 0 && of_cursor > 0 ? static_cast<double>(of_picture) / of_cursor : 1.0;
  };
  return {along(pixels.width, units.width), along(pixels.height, units.height)};
}

bool Window::has_screen() {
  const auto is_set = [](const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

Window::Window(const WindowPlace& place, Visibility visibility) {
  if (glfwInit() != GLFW_TRUE) fail("the screen cannot be opened");
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS, GLFW_LOSE_CONTEXT_ON_RESET);
  glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, gl_faults_are_reported() ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);  // until it has its size
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, place.size ? GLFW_FALSE : GLFW_TRUE);
  glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);  // who looks at another monitor goes on seeing it
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  if (place.monitor) {
    try {
      monitor = numbered_monitor(*place.monitor);
    } catch (...) {
      glfwTerminate();
      throw;
    }
  }
  const PictureSize size = place.size.value_or(kSuitableSize);
  try {
    handle_ = make_window(size);
  } catch (...) {
    glfwTerminate();
    throw;
  }
  glfwSetWindowUserPointer(handle_, this);
  glfwSetKeyCallback(handle_, on_key);
  glfwSetCursorPosCallback(handle_, on_cursor);
  glfwSetCursorEnterCallback(handle_, on_enter);
  glfwSetMouseButtonCallback(handle_, on_button);
  glfwSetScrollCallback(handle_, on_scroll);
  glfwSetWindowRefreshCallback(handle_, on_exposed);
  glfwSetWindowPosCallback(handle_, on_moved);
  glfwSetWindowSizeCallback(handle_, on_resized);
  outlive_the_screen();
  watch_for_faults();
  shows_parts_ = can_show_parts(handle_);
  glfwSwapInterval(1);
  if (!place.size || place.monitor) fit(monitor, place.monitor.has_value());
  if (visibility == Visibility::hidden) return;
  if (place.full_screen) {
    fill(monitor);
  } else {
    glfwShowWindow(handle_);
  }
}

Window::~Window() {
  if (g_screen_is_gone) return;  // no screen is left to give anything back to
  glfwDestroyWindow(handle_);
  glfwTerminate();
}

PictureSize Window::size() const {
  PictureSize size;
  glfwGetFramebufferSize(handle_, &size.width, &size.height);
  return size;
}

void Window::set_title(const std::string& title) {
  glfwSetWindowTitle(handle_, title.c_str());
}

void Window::resize(PictureSize size) {
  glfwSetWindowSize(handle_, size.width, size.height);
}

void Window::on_exposed(GLFWwindow* handle) {
  window_of(handle).input_.exposed = true;
}

void Window::on_moved(GLFWwindow* handle, int /*x*/, int /*y*/) {
  window_of(handle).moved_ = true;
}

void Window::on_resized(GLFWwindow* handle, int /*width*/, int /*height*/) {
  window_of(handle).moved_ = true;
}

void Window::present(const RenderTarget& target, std::span<const PixelRect> parts) {
  const PictureSize size = target.size();
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);  // Mesa takes a new size over from a bound window only
  const auto copy = [&](const PixelRect& rect) {
    glEnable(GL_SCISSOR_TEST);
    glScissor(rect.x0, rect.y0, rect.x1 - rect.x0, rect.y1 - rect.y0);
    glBlitNamedFramebuffer(target.framebuffer(), 0, 0, 0, size.width, size.height, 0, 0, size.width,
                           size.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  };
  const std::vector<PixelRect> rects = joined(clipped(parts, target.all()));
  const bool whole = std::ranges::find(rects, target.all()) != rects.end();
  bool shows = std::exchange(has_shown_, true) && shows_parts_ && !whole && has_size(handle_, size);
  if (shows) {
    // Nothing else in the back buffer is shown. A part beyond the size that Mesa took over with
    // the first of these calls after a swap would be an error of X, which ends the process.
    for (const PixelRect& rect : rects) copy(rect);
    shows = has_size(handle_, size);
  }
  if (shows) {
    for (const PixelRect& rect : rects) {
      glXCopySubBufferMESA(glXGetCurrentDisplay(), glXGetCurrentDrawable(), rect.x0, rect.y0,
                           rect.x1 - rect.x0, rect.y1 - rect.y0);
    }
  } else {
    copy(target.all());
    glfwSwapBuffers(handle_);
  }
  glDisable(GL_SCISSOR_TEST);
}

void Window::show_pointer(bool shown) {
  if (std::exchange(pointer_shown_, shown) == shown) return;
  glfwSetInputMode(handle_, GLFW_CURSOR, shown ? GLFW_CURSOR_NORMAL : GLFW_CURSOR_HIDDEN);
}

WindowInput Window::poll() {
  glfwPollEvents();
  if (!g_screen_is_gone) follow_screen();
  if (g_screen_is_gone) {
    throw VisualizerError(
        "window: the X server is gone; the controller goes on, so start "
        "kerf-visualizer again on another screen or with --headless --out DIR");
  }
  input_.close = glfwWindowShouldClose(handle_) == GLFW_TRUE;
  PictureSize units;
  glfwGetWindowSize(handle_, &units.width, &units.height);
  input_.size = size();
  const glm::dvec2 scale = pixels_per_unit(input_.size, units);
  input_.pointer.x = cursor_x_ * scale.x;
  input_.pointer.y = cursor_y_ * scale.y;
  const bool seen = is_seen();
  input_.visible = seen;
  if (!seen) let_go();
  // A pointer with a button down belongs to this window wherever it goes: its place tells.
  input_.hovers = cursor_known_ && is_over();
  input_.left = input_.left || !input_.hovers;
  if (down_[GLFW_MOUSE_BUTTON_LEFT]) input_.pointer.down = true;
  input_.of_view = input_.of_view || down_[GLFW_MOUSE_BUTTON_RIGHT] ||
                   down_[GLFW_MOUSE_BUTTON_MIDDLE] || (input_.pointer.down && has_shift(handle_));
  float density = 1.0F;
  glfwGetWindowContentScale(handle_, &density, nullptr);
  input_.density = static_cast<double>(density);
  HeldControls& held = input_.held;
  held.deeper = of_keys(handle_, GLFW_KEY_PAGE_DOWN, GLFW_KEY_PAGE_UP);
  held.tilt_right = of_keys(handle_, GLFW_KEY_LEFT, GLFW_KEY_RIGHT);
  held.tilt_up = of_keys(handle_, GLFW_KEY_DOWN, GLFW_KEY_UP);
  held.pedal = pedal_;
  if (seen) add_gamepad(held);
  return std::exchange(input_, {});
}

bool Window::is_seen() const {
  return glfwGetWindowAttrib(handle_, GLFW_VISIBLE) == GLFW_TRUE &&
         glfwGetWindowAttrib(handle_, GLFW_ICONIFIED) == GLFW_FALSE;
}

bool Window::is_over() const {
  int width = 0;
  int height = 0;
  glfwGetWindowSize(handle_, &width, &height);
  return cursor_x_ >= 0 && cursor_y_ >= 0 && cursor_x_ < width && cursor_y_ < height &&
         glfwGetWindowAttrib(handle_, GLFW_HOVERED) == GLFW_TRUE;
}

void Window::let_go() noexcept {
  down_ = {};
  pedal_ = false;
  input_.left = true;
}

void Window::on_key(GLFWwindow* handle, int key, int scancode, int action, int mods) {
  Window& window = window_of(handle);
  if (key == GLFW_KEY_SPACE && action != GLFW_REPEAT) window.pedal_ = action == GLFW_PRESS;
  if (action != GLFW_PRESS) return;
  window.f11_ = window.f11_ != (key == GLFW_KEY_F11);
  const bool shift = key == GLFW_KEY_LEFT_SHIFT || key == GLFW_KEY_RIGHT_SHIFT;
  if (shift && window.down_[GLFW_MOUSE_BUTTON_LEFT]) window.input_.of_view = true;
  const char letter = letter_of(key, scancode);
  const bool redo = (letter == 'z' && (mods & GLFW_MOD_SHIFT) != 0) ||
                    (letter == 'y' && (mods & GLFW_MOD_CONTROL) != 0);
  if (letter != '\0') window.input_.keys.push_back(redo ? 'Z' : letter);
}

void Window::on_cursor(GLFWwindow* handle, double x, double y) {
  Window& window = window_of(handle);
  const double right = x - std::exchange(window.cursor_x_, x);
  const double up = std::exchange(window.cursor_y_, y) - y;
  if (!std::exchange(window.cursor_known_, true)) {  // it came from elsewhere
    window.input_.came = window.has_shown_;          // else the window came to it
    return;
  }
  int width = 0;
  int height = 0;
  glfwGetWindowSize(handle, &width, &height);
  if (height <= 0) return;
  const bool left = window.down_[GLFW_MOUSE_BUTTON_LEFT];
  const bool shift = has_shift(handle);
  WindowInput& input = window.input_;
  if (window.down_[GLFW_MOUSE_BUTTON_MIDDLE] || (left && shift)) {
    input.move_right += right / height;
    input.move_up += up / height;
  } else if (window.down_[GLFW_MOUSE_BUTTON_RIGHT]) {
    input.turn_right += right / height;
    input.turn_up += up / height;
  } else if (left) {
    input.drag_right += right / height;
    input.drag_up += up / height;
  } else {
    input.free_right += right / height;
    input.free_up += up / height;
  }
}

void Window::on_enter(GLFWwindow* handle, int entered) {
  if (entered == GLFW_TRUE) return;
  window_of(handle).cursor_known_ = false;
  window_of(handle).input_.left = true;
}

void Window::on_button(GLFWwindow* handle, int button, int action, int /*mods*/) {
  Window& window = window_of(handle);
  const auto at = static_cast<std::size_t>(button);
  if (at < window.down_.size()) window.down_[at] = action == GLFW_PRESS;
  if (action != GLFW_PRESS) return;
  // A click may be over before the next `poll`.
  (button == GLFW_MOUSE_BUTTON_LEFT ? window.input_.pointer.down : window.input_.of_view) = true;
}

void Window::on_scroll(GLFWwindow* handle, double /*x*/, double y) {
  const bool control = glfwGetKey(handle, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS ||
                       glfwGetKey(handle, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
  WindowInput& input = window_of(handle).input_;
  (control ? input.zoom : has_shift(handle) ? input.plane : input.wheel) += y;
  input.pointer.wheel += y;
}

}  // namespace kerf
