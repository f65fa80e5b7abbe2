// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/sound/spindle_voice.hpp"

namespace kerf {

/// What a window tells its player, as one packet.
struct SoundMessage {
  ToolSound sound;
  bool mute = false;
};

/// A process of its own plays what comes through `socket`, until the other end is closed: it
/// returns no earlier, and is to end then. The device is opened at the first message that is not
/// mute. Where there is none, or it goes, one packet of text says so, and nothing is played.
void play_sound(int socket);

}  // namespace kerf
