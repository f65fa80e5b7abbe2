// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/segment/layout.hpp"
#include "visualizer/sound/spindle_voice.hpp"

namespace kerf {

/// What is heard of a tick. A spindle that turns, or a tool that is drawn over a surface, rubs; a
/// tool that rests on one makes no sound, however hard it presses. What a record does not know
/// (NaN) is not heard.
[[nodiscard]] ToolSound tool_sound(const TickRecord& record);

}  // namespace kerf
