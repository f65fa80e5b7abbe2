// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <imgui.h>

namespace kerf {

/// Replaces the letters of `fonts` by those of DejaVu Sans, `pixels` from the top of an `f` to the
/// foot of a `g`: Latin with all its accents. The font is part of the program, so that panels are
/// the same on every machine. What other letters there are is shown as a question mark.
void load_panel_font(ImFontAtlas& fonts, float pixels);

}  // namespace kerf
