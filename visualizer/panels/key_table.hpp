// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace kerf {

/// Keys of the window and their meanings, for `--help` and the overlay.
struct KeyHelp {
  const char* key;
  const char* meaning;
};
// Short: a page of them covers at most a quarter of a small window (overlay.hpp).
inline constexpr auto kKeys = std::to_array<KeyHelp>({
    {"drag", "turn"},
    {"shift + drag", "move; or the middle button"},
    {"wheel", "nearer, farther"},
    {"r", "first view again"},
    {"z", "undo the last stroke"},
    {"shift + z", "cut it again"},
    {"u, u", "undo all cuts"},
    {"f", "mark this moment in the log"},
    {"1 .. 9", "take this tool"},
    {"v", "next renderer"},
    {"b", "v is for one volume; for all"},
    {"c", "clip plane"},
    {"x", "it faces you, through the tip"},
    {"shift + wheel", "moves the clip plane"},
    {"l", "three slices through the tip"},
    {"y", "colours for the colour-blind"},
    {"t", "stereo: two eyes side by side"},
    {"o", "open a scene or a volume"},
    {"p", "plot of force and depth"},
    {"s", "screenshot"},
    {"m", "movie: begin, end"},
    {"a", "sound: off, on"},
    {"w", "write the opacities"},
    {"n", "note the view: a file"},
    {"e", "export the surface"},
    {"F11", "full screen; window"},
    {"h", "keys, no panels, panels"},
    {"q", "quit"},
});

/// Rows at its begin that the mouse does alone.
inline constexpr std::size_t kMouseKeys = 3;

/// What changes when the pointer leads the emulated hand (--hand-socket).
inline constexpr auto kHandKeys = std::to_array<KeyHelp>({
    {"pointer", "leads the hand: see the ring"},
    {"left button", "press: only this cuts"},
    {"space", "pedal: cuts without pressing"},
    {"wheel", "deeper; or page up, down"},
    {"arrows", "tilt the tool"},
    {"g", "the hand comes here"},
    {"k", "park, take up: clears a fault"},
    {"right drag", "turn"},
    {"middle drag", "move the picture"},
    {"ctrl + wheel", "zoom"},
    {"gamepad", "sticks move, A press,"},
    {"", "cross tilt"},
    {"SpaceMouse", "moves and tilts; presses"},
});

}  // namespace kerf
