// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace kerf {

/// What the user may do in the window, as `--help` and the overlay tell it.
struct KeyHelp {
  const char* key;
  const char* meaning;
};
inline constexpr auto kKeys = std::to_array<KeyHelp>({
    {"drag", "turn"},
    {"shift or middle drag", "move"},
    {"wheel", "nearer, farther"},
    {"r", "first view again"},
    {"1 .. 9", "take this tool"},
    {"v", "next renderer"},
    {"b", "v is for one volume after another; then for all"},
    {"c", "clip plane"},
    {"t", "two eyes: stereo, side by side"},
    {"p", "plot of force and depth"},
    {"s", "screenshot"},
    {"m", "movie: begin, end"},
    {"w", "write the opacities"},
    {"e", "export the surface"},
    {"h", "these keys; again: no panels; again: panels"},
    {"q", "quit"},
});

}  // namespace kerf
