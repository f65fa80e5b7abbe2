// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "shared/segment/command.hpp"
#include "visualizer/picture/seen_bodies.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// The command line of kerf-visualizer.
struct VisualizerOptions {
  std::string name = kDefaultName;  ///< of the controller
  ViewSettings settings;            ///< at first; its opacities are those of `transfer`
  bool renderer_is_given = true;    ///< else `take_default_renderer`
  PictureSize size{800, 600};
  bool size_is_given = true;  ///< else a window takes what suits its screen
  bool full_screen = false;
  int monitor = 0;                    ///< of the window, counted from 1; 0: none is chosen
  std::optional<double> panel_scale;  ///< of the panels' letters; none: the display's density
  bool panels = true;                 ///< at first; headless: all the time
  std::optional<std::filesystem::path> camera_file;  ///< of --camera; none: it gave numbers, or no
  bool present = false, follow_view = false;         ///< one of both at most
  bool headless = false;
  std::uint32_t frames = 10;  ///< headless: this many pictures; beside a video none by default
  std::optional<std::uint64_t> every_ticks;  ///< headless: default once a second of servo time
  std::filesystem::path out = ".";           ///< pictures, screenshots
  std::optional<double> seconds;             ///< ends after this time; default: with the controller
  std::optional<double> ends_after_s;        ///< of servo time, the run ends: said before it does
  double wait_s = 10.0;                      ///< for the controller to appear
  std::optional<std::filesystem::path> attached;  ///< --attached: made once it is shown
  bool mute = false;                              ///< no sound until the user asks for it
  std::optional<std::filesystem::path> choice;    ///< --choice: made with what o chose
  std::filesystem::path open_in = ".";            ///< where o looks first
  std::optional<std::string> hand_socket;         ///< where an emulator's hand is to be led
  std::optional<std::string> lead;                ///< headless: FIFO of a controller in lock-step
  std::optional<std::string> record;              ///< video: a file, a pipe, or "-" for stdout
  int video_hz = 60;                              ///< its frames per second of servo time
  std::optional<std::filesystem::path> transfer;  ///< opacities, TOML
  std::vector<int> cpus;                          ///< empty: all but the last one
  std::optional<std::filesystem::path> mesh;      ///< --export: .stl or .ply
  AovChoice aov;                                  ///< headless: beside each picture
  std::optional<std::filesystem::path> sheet;     ///< headless: the final state by every renderer
  std::optional<std::filesystem::path> report;
  bool bench = false;                         ///< no controller: what pictures cost here
  std::optional<std::filesystem::path> page;  ///< bench: as a part of this Markdown file
};

/// "WxH"; throws VisualizerError.
[[nodiscard]] PictureSize parse_size(const std::string& text);

/// Throws VisualizerError for a value that cannot be used, and nothing else: `--help` and
/// `--version` print and give no options.
[[nodiscard]] std::optional<VisualizerOptions> parse_options(int argc, const char* const* argv);

}  // namespace kerf
