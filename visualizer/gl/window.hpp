// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/gl/context.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/scene/pixel_rect.hpp"

struct GLFWmonitor;
struct GLFWwindow;

namespace kerf {

/// How far what is held down would have the hand go on moving, each -1 to 1: keys (page up and
/// down, arrows) and the first gamepad together.
struct HeldControls {
  double right = 0.0, up = 0.0;            ///< in the picture's plane; left stick
  double deeper = 0.0;                     ///< away from the eye; page up and down, right stick
  double tilt_right = 0.0, tilt_up = 0.0;  ///< arrows, the pad's cross
  bool press = false;                      ///< the pad's right bumper or lower button
  bool pedal = false;                      ///< the space bar
  bool by_pad = false;                     ///< a gamepad has a part in it
};

/// What the user did since the last `Window::poll`. Distances are fractions of the window's height,
/// to the right and upwards.
struct WindowInput {
  double turn_right = 0.0, turn_up = 0.0;  ///< with the right button
  double drag_right = 0.0, drag_up = 0.0;  ///< with the left one
  double free_right = 0.0, free_up = 0.0;  ///< with none
  double move_right = 0.0, move_up = 0.0;  ///< with the middle one, or the left one and shift
  double wheel = 0.0;
  double zoom = 0.0;       ///< the wheel with control
  double plane = 0.0;      ///< with shift
  bool of_view = false;    ///< the right or the middle button was down, or shift with the left one
  HeldControls held;       ///< now
  bool hovers = false;     ///< the pointer is over the window, and nothing lies between
  bool came = false;       ///< it came over the window, which showed a picture already
  bool left = false;       ///< it was elsewhere in between, or the window was not visible
  bool visible = true;     ///< neither minimised nor taken off the screen
  PictureSize size;        ///< as `Window::size`, at the end; `pointer` is in its pixels
  Pointer pointer;         ///< at the end; down if it was so at any time
  std::vector<char> keys;  ///< lower-case letters and digits as printed on them
  double density = 1.0;    ///< of the display, over that of 96 dots per inch
  bool exposed = false;    ///< what the window showed is lost: `present` again
  bool close = false;
};

/// How many pixels of a window's picture lie in one unit of its cursor, along each side: screens of
/// high density count in larger units than pixels. 1 for a window without a side.
[[nodiscard]] glm::dvec2 pixels_per_unit(PictureSize pixels, PictureSize units) noexcept;

/// What a window takes that is given no size: room for all panels beside a tooth, in units of 96
/// dots per inch.
inline constexpr PictureSize kSuitableSize{1280, 800};

/// How a window opens.
struct WindowPlace {
  /// Without one: `kSuitableSize` at the scale of its monitor, or as much of it as there is room
  /// for beside the desktop's bars and the window's frame.
  std::optional<PictureSize> size{};
  bool full_screen = false;      ///< `size` is what it has after that
  std::optional<int> monitor{};  ///< counted from 1; none: where the desktop puts it
};

/// The one of `monitors` that shows most of `window`; the first if none does.
[[nodiscard]] std::size_t monitor_of(const PixelRect& window, std::span<const PixelRect> monitors);

/// A window on the screen with its own context; what it shows is drawn off the screen and copied.
class Window final : public GlContext {
 public:
  enum class Visibility : std::uint8_t { shown, hidden };

  /// Whether the environment names a screen.
  [[nodiscard]] static bool has_screen();

  /// Throws VisualizerError if the screen gives no window or no context that can draw, or has
  /// no such monitor.
  Window(const WindowPlace& place, Visibility visibility);
  ~Window() override;

  [[nodiscard]] ContextKind kind() const noexcept override { return ContextKind::window; }
  /// In pixels; a side is 0 while the window is minimised.
  [[nodiscard]] PictureSize size() const;
  void set_title(const std::string& title);
  /// Asks the screen for another size, which `size` returns once the screen has given it.
  void resize(PictureSize size);
  /// F11 does so too, on the monitor that shows most of the window. A monitor that is unplugged
  /// leaves a window on another one.
  void set_full_screen(bool full);
  /// Shows `target`, which has the window's size and is what the call before showed but for
  /// `parts`; waits for the screen's refresh if it can.
  void present(const RenderTarget& target, std::span<const PixelRect> parts);
  /// Whether the pointer is seen over it.
  void show_pointer(bool shown);
  /// Throws VisualizerError once the X server is gone.
  [[nodiscard]] WindowInput poll();

 private:
  /// Throws VisualizerError, with the monitors that there are, if it is none of them.
  [[nodiscard]] static GLFWmonitor* numbered_monitor(int number);
  /// Nowhere, if no monitor is plugged in.
  void fill(GLFWmonitor* monitor);
  /// No larger than the monitor has room for; in its middle if `moves`.
  void fit(GLFWmonitor* monitor, bool moves);
  /// Becomes the window that it was before it filled a monitor.
  void leave_full_screen();
  /// After events: F11, a monitor that went away, a pointer that rests while the window moves.
  void follow_screen();
  /// False while it is minimised or taken off the screen.
  [[nodiscard]] bool is_seen() const;
  /// Whether the pointer is over the part of the window that is seen.
  [[nodiscard]] bool is_over() const;
  /// Lets go of all that is held down: its end will not be told.
  void let_go() noexcept;

  static void on_key(GLFWwindow* handle, int key, int scancode, int action, int mods);
  static void on_cursor(GLFWwindow* handle, double x, double y);
  static void on_enter(GLFWwindow* handle, int entered);
  static void on_button(GLFWwindow* handle, int button, int action, int mods);
  static void on_scroll(GLFWwindow* handle, double x, double y);
  static void on_exposed(GLFWwindow* handle);
  static void on_moved(GLFWwindow* handle, int x, int y);
  static void on_resized(GLFWwindow* handle, int width, int height);

  GLFWwindow* handle_ = nullptr;
  WindowInput input_;
  double cursor_x_ = 0.0;
  double cursor_y_ = 0.0;
  bool cursor_known_ = false;   ///< it is over the window, and has said where
  std::array<bool, 3> down_{};  ///< buttons, by GLFW's numbers
  bool pedal_ = false;          ///< the space bar is down
  bool pointer_shown_ = true;
  bool shows_parts_ = false;  ///< a part of its picture costs less than the whole
  bool has_shown_ = false;    ///< a picture
  bool f11_ = false;          ///< pressed since the last `poll`
  bool moved_ = false;        ///< the window, or its edges
  bool full_screen_ = false;
  PixelRect before_;  ///< it filled a monitor: from the upper left corner of the desktop
};

}  // namespace kerf
