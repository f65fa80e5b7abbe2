// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace kerf {

// A choice as on the command line: one renderer for all volumes of a scene, or one for each in the
// scene's order, with commas between. Of those that look into volumes a choice has one kind at
// most: only what one renderer draws mixes where it intersects.

/// Throws VisualizerError for a choice that no scene can have.
void check_renderers(const std::string& choice);

/// The same by volume; throws for another number of volumes too.
[[nodiscard]] std::vector<std::string> renderer_of_each(const std::string& choice,
                                                        std::size_t volumes);

/// `choice` with another renderer for one of `volumes` volumes. If the new renderer is translucent,
/// it replaces every translucent one.
[[nodiscard]] std::string with_renderer(const std::string& choice, std::size_t volumes,
                                        std::size_t volume, const std::string& kind);

/// `choice` with the renderer after that of the first volume for all.
[[nodiscard]] std::string next_renderer(const std::string& choice);
/// The same for one of `volumes` volumes.
[[nodiscard]] std::string next_renderer(const std::string& choice, std::size_t volumes,
                                        std::size_t volume);

}  // namespace kerf
