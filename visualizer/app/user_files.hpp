// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "visualizer/app/film.hpp"
#include "visualizer/app/notices.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/app/picture.hpp"

namespace kerf {

// What keys of the window write: each says where it went, or why it did not. A full disk must not
// end a session at the screen. New files are kerf-0001 and so on in --out.

[[nodiscard]] Notice take_screenshot(const VisualizerOptions& options, const RenderTarget& target);

/// Begins a video in a new file, or ends the one that runs.
[[nodiscard]] Notice toggle_film(const VisualizerOptions& options, PictureSize size,
                                 std::optional<Film>& film);

/// Where --transfer read them, or in a new file.
[[nodiscard]] Notice write_opacities(const VisualizerOptions& options, const Picture& picture);

/// Where --export says, or in a new file.
[[nodiscard]] Notice export_mesh(const VisualizerOptions& options, const Session& session);

}  // namespace kerf
