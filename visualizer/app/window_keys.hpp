// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "visualizer/app/options.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/panels/overlay.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/picture/picture.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf {

/// Gives the picture other settings. If their renderer cannot show these volumes, the picture keeps
/// its own and a notice gives the reason.
void change_view(Picture& picture, const Session& session, const ViewSettings& settings,
                 Notices& notices, Notices::Clock::time_point now);

/// Message to a user who asks for tool `index`, counted from 0, of a scene that has `tools`.
[[nodiscard]] std::string no_such_tool(std::size_t index, std::size_t tools);

/// Message to a user whose undo a controller refuses that has `newest` as its newest tick: the one
/// reason that is true. `removed`: something is removed now; `cut_before`: something was cut before
/// this window joined, so that what is removed is unknown.
[[nodiscard]] std::string no_undo(const std::optional<TickRecord>& newest, bool removed,
                                  bool cut_before);

/// Asks the controller for a tool, counted from 0; a message if nothing came of it.
void take_tool(std::size_t index, Session& session, Notices& notices,
               Notices::Clock::time_point now);

/// What the keys of a window have switched, and what they have asked for. Who does what was asked
/// sets it back to false.
struct WindowKeys {
  int help = 0;         ///< page of the keys
  int help_pages = 1;   ///< there are so many
  bool hidden = false;  ///< the panels
  bool plot = false;
  bool slices = false;
  bool open = false;  ///< open the list of scenes, or leave it
  bool screenshot = false;
  bool mesh = false;       ///< export the surface
  bool write = false;      ///< write the opacities
  bool note = false;       ///< write the camera
  bool film = false;       ///< begin a film, or end it
  bool come = false;       ///< the hand comes to the pointer
  bool park = false;       ///< it brings the stylus to rest and back
  bool end_press = false;  ///< cuts are undone or redone: the press that is held ends
  std::size_t one = 0;     ///< volume that v is for, counted from 1; 0: all
  std::optional<Notices::Clock::time_point> undo_asked{};  ///< u once: the second one is meant

  /// Takes the keys of `input`: the camera and the settings of `picture`, and the tool, follow at
  /// once. True when the user wants to leave.
  bool apply(const WindowInput& input, Session& session, Picture& picture, double aspect,
             Notices& notices, Notices::Clock::time_point now);

  /// Shows `panel` in the place of `other`, or no longer; while all panels are hidden, they come
  /// back with it.
  void switch_panel(bool& panel, bool& other);
};

// What keys of the window write: each returns where it was written, or why it was not. A full disk
// must not end a session at the screen. New files are kerf-0001 and so on in --out.

[[nodiscard]] Notice take_screenshot(const VisualizerOptions& options, const RenderTarget& target);

/// Begins a video in a new file, or ends the one that runs.
[[nodiscard]] Notice toggle_film(const VisualizerOptions& options, PictureSize size,
                                 std::optional<Film>& film);

/// Where --transfer read them, or in a new file.
[[nodiscard]] Notice write_opacities(const VisualizerOptions& options, const Picture& picture);

/// Where --camera read it, or in a new file.
[[nodiscard]] Notice write_view(const VisualizerOptions& options, const Picture& picture);

/// To the file of --export, or to a new one.
[[nodiscard]] Notice export_mesh(const VisualizerOptions& options, const Session& session);

}  // namespace kerf
