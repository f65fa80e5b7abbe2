// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/studies/monkey/test_controller.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/app/window_run.hpp"
#include "visualizer/gl/context.hpp"

namespace kerf {

/// A picture, as `RenderTarget::read_rgb` gives it.
struct MonkeyPicture {
  PictureSize size{0, 0};
  std::vector<std::uint8_t> rgb{};
};

/// Somebody who presses keys, drags, turns the wheel, resizes, works the panels, and whose
/// controller mills, ends and comes back, without a plan but repeatable by its seed. What the
/// window then shows is compared, pixel by pixel, with a picture of the same state that shares
/// nothing with it: another session, renderers, layers and target, drawn once. A partial redraw
/// that leaves out a pixel shows here.
///
/// Needs a GL context and no window; time is a number that grows by a frame. XDG_RUNTIME_DIR holds
/// the controller's socket. One at a time.
class Monkey {
 public:
  /// What it has done.
  struct Count {
    std::uint64_t events = 0, frames = 0, compared = 0;
    Count& operator+=(const Count& more) noexcept;
  };

  struct Habits {
    std::uint32_t seed = 1;
    std::filesystem::path folder;  ///< for what keys write
    /// Which is then the context, and shows what it would, at sizes that follow those of the
    /// picture.
    Window* window = nullptr;
    bool large = false;  ///< the picture has 800x600 or 1100x760 pixels, and not any size
  };

  /// Throws as Session and Picture do.
  Monkey(const GlContext& context, const Habits& habits);

  /// One event: what happened before a frame, and frames until all of it is shown. Throws
  /// VisualizerError if the window shows something else than the fresh picture.
  void act();
  /// What `act` does next, or did last.
  [[nodiscard]] const std::string& event() const noexcept { return event_; }
  [[nodiscard]] const Count& count() const noexcept { return count_; }
  /// What the window shows, and what it should.
  [[nodiscard]] const MonkeyPicture& shown() const noexcept { return shown_; }
  [[nodiscard]] const MonkeyPicture& expected() const noexcept { return expected_; }

 private:
  void choose(WindowInput& input);
  void press_key(WindowInput& input);
  void use_mouse(WindowInput& input);
  void use_panel(WindowInput& input);
  void resize(WindowInput& input);
  void use_controller();
  void restart_controller();
  void say(const std::string& what);
  void frame(const WindowInput& input);
  void rest();
  void compare();
  [[nodiscard]] MonkeyPicture drawn_anew();

  Window* window_;
  bool large_;
  RandomNumbers dice_;
  VisualizerOptions options_;
  std::unique_ptr<MonkeyController> controller_;
  std::optional<WindowRun> run_;
  WindowRun::Clock::time_point now_{};
  PictureSize size_;
  Pointer pointer_;
  bool release_ = false;  ///< the button goes up in the next frame
  std::string event_;
  MonkeyPicture shown_, expected_;
  bool rests_ = true;  ///< the last frame drew nothing
  Count count_;
};

}  // namespace kerf
