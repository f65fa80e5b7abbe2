// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace kerf {

/// What the user may do in the window, as `--help` and the overlay tell it.
struct KeyHelp {
  const char* key;
  const char* meaning;
};
inline constexpr auto kKeys = std::to_array<KeyHelp>({
    {"drag, left or right", "turn"},
    {"shift or middle drag", "move"},
    {"wheel", "nearer, farther"},
    {"r", "first view again"},
    {"u, u", "undo all cuts: the volumes as they were"},
    {"1 .. 9", "take this tool"},
    {"v", "next renderer"},
    {"b", "v is for one volume after another; then for all"},
    {"c", "clip plane"},
    {"t", "two eyes: stereo, side by side"},
    {"p", "plot of force and depth"},
    {"s", "screenshot"},
    {"m", "movie: begin, end"},
    {"a", "sound: off, on"},
    {"w", "write the opacities"},
    {"e", "export the surface"},
    {"h", "these keys; again: no panels; again: panels"},
    {"q", "quit"},
});

/// Rows at its begin that the mouse does alone.
inline constexpr std::size_t kMouseKeys = 3;

/// What changes where the pointer leads the emulated hand (--hand-socket).
inline constexpr auto kHandKeys = std::to_array<KeyHelp>({
    {"pointer", "leads the hand; the ring is where it wants to be"},
    {"left button", "press"},
    {"wheel, page up/down", "deeper, nearer"},
    {"arrows", "tilt the tool"},
    {"g", "the hand comes to the pointer"},
    {"k", "park the stylus and take it again: clears a fault"},
    {"right drag", "turn"},
    {"middle drag", "move the picture"},
    {"control + wheel", "zoom"},
    {"gamepad", "left stick: move; right: depth; A: press; cross: tilt"},
    {"SpaceMouse", "the cap moves and tilts; its first button presses"},
});

}  // namespace kerf
