// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <future>
#include <string>
#include <vector>

#include <unistd.h>

#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"
#include "tests/json.hpp"
#include "tests/visualizer/render/rgb_picture.hpp"

namespace kerf::test {

/// Whether a program is installed; else says that a test is skipped.
[[nodiscard]] bool have(const char* program);

/// A screen that nobody sees, and a private folder.
class Screen {
 public:
  explicit Screen(const std::string& size = "1280x960", bool has_glx = true);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  void end(int signal);

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("kerf-window-" + std::to_string(::getpid()));

 private:
  pid_t server_ = -1;
};

/// A controller of the name "test" that shows one block, or two beside one another, and has two
/// tools.
class Controller {
 public:
  explicit Controller(int blocks = 1);
  void tick();
  /// What the window asked for since the last call.
  std::vector<std::uint64_t> asked_tools();
  /// How often it asked for an undo since the last call; forgets what else it asked for.
  int undos() { return asked(CommandKind::undo); }
  /// From the next tick on: the last stroke can be undone.
  void offer_undo() { flags_ = kFlagUndoable; }
  /// From the next tick on: the device has been picked up.
  void take_in_hand() { flags_ = kFlagStarted; }
  /// How often it asked for a reset since the last call; forgets the tools that it asked for.
  int resets() { return asked(CommandKind::reset); }
  void say(Lifecycle lifecycle) { writer_.set_lifecycle(lifecycle); }

 private:
  int asked(CommandKind kind);

  std::uint32_t flags_ = 0;
  std::vector<Density> density_;
  SegmentWriter writer_;
  SegmentServer server_;
  Tick now_ = 0;
};

/// Another program's window, on top of all there are now: of `x, y, width, height` in pixels.
class OtherWindow {
 public:
  explicit OtherWindow(const std::array<int, 4>& place);
  ~OtherWindow();
  OtherWindow(const OtherWindow&) = delete;
  OtherWindow& operator=(const OtherWindow&) = delete;
  void take_focus() const;

 private:
  void* display_;
  unsigned long window_;
};

/// As a desktop tells its programs how dense its display is, while this lives.
class DisplayDensity {
 public:
  explicit DisplayDensity(int dots_per_inch);
  ~DisplayDensity();
  DisplayDensity(const DisplayDensity&) = delete;
  DisplayDensity& operator=(const DisplayDensity&) = delete;

 private:
  void* display_;
};

/// The one monitor of the screen is unplugged while this lives, by RandR, whose library comes with
/// GLFW and whose headers do not.
class UnpluggedMonitor {
 public:
  UnpluggedMonitor();
  ~UnpluggedMonitor();
  UnpluggedMonitor(const UnpluggedMonitor&) = delete;
  UnpluggedMonitor& operator=(const UnpluggedMonitor&) = delete;

 private:
  void* library_;
  void* display_;
  void* resources_;
  void* before_;
};

/// Of the window on the screen that DISPLAY names, once there is one.
[[nodiscard]] PictureSize seen_size();
/// Where its upper left corner is.
[[nodiscard]] std::array<int, 2> seen_place();

/// The upper left corner of the screen that DISPLAY names.
[[nodiscard]] RgbPicture read_screen(PictureSize size);

/// Real events at the screen that DISPLAY names, and the time in which a window shows what they do.
void act(const std::string& events);

/// A window, and a user before it.
class User {
 public:
  explicit User(const std::filesystem::path& folder, int blocks = 1);

  /// The window with its panels.
  RgbPicture whole();
  /// The middle of it, where no panel is.
  std::vector<std::uint8_t> picture();
  /// The same as it stands on the screen, whose upper left corner the window is in.
  std::vector<std::uint8_t> look_at_screen();

  /// Presses `m` and waits for the file: a window that is resized meanwhile begins with its new
  /// size.
  void begin_video();

  int quit();
  /// Of a window that ends by itself.
  int ended() { return code_.get(); }
  /// What was chosen to be opened; empty: nothing yet.
  [[nodiscard]] std::string choice() const;
  [[nodiscard]] const std::filesystem::path& out() const { return out_; }
  [[nodiscard]] Controller& controller() { return controller_; }
  [[nodiscard]] test::ReadJson report() const;

 private:
  std::filesystem::path out_, report_, choice_;
  Controller controller_;
  std::future<int> code_;
};

}  // namespace kerf::test
