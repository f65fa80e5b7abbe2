// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "visualizer/gl/context.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/view/pixel_rect.hpp"

struct GLFWwindow;

namespace kerf {

/// What the user did since the last `Window::poll`. Distances are fractions of the window's height,
/// to the right and upwards.
struct WindowInput {
  double turn_right = 0.0, turn_up = 0.0;
  double move_right = 0.0, move_up = 0.0;
  double wheel = 0.0;
  Pointer pointer;         ///< at the end; down if it was so at any time
  std::vector<char> keys;  ///< lower-case letters and digits as printed on them
  bool exposed = false;    ///< what the window showed is lost: `present` again
  bool close = false;
};

/// A window on the screen with its own context; what it shows is drawn off the screen and copied.
class Window final : public GlContext {
 public:
  enum class Visibility : std::uint8_t { shown, hidden };

  /// Whether the environment names a screen.
  [[nodiscard]] static bool has_screen();

  /// Throws VisualizerError where the screen gives no window or no 4.5 core context.
  Window(PictureSize size, Visibility visibility);
  ~Window() override;

  [[nodiscard]] ContextKind kind() const noexcept override { return ContextKind::window; }
  /// In pixels; a side is 0 while the window is minimised.
  [[nodiscard]] PictureSize size() const;
  void set_title(const std::string& title);
  /// Shows `target`, which has the window's size; waits for the screen's refresh where it can.
  void present(const RenderTarget& target);
  /// Throws VisualizerError once the X server is gone.
  [[nodiscard]] WindowInput poll();

 private:
  static void on_key(GLFWwindow* handle, int key, int scancode, int action, int mods);
  static void on_cursor(GLFWwindow* handle, double x, double y);
  static void on_button(GLFWwindow* handle, int button, int action, int mods);
  static void on_scroll(GLFWwindow* handle, double x, double y);
  static void on_exposed(GLFWwindow* handle);

  GLFWwindow* handle_ = nullptr;
  WindowInput input_;
  double cursor_x_ = 0.0;
  double cursor_y_ = 0.0;
};

}  // namespace kerf
