// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <imgui.h>

#include "visualizer/panels/overlay.hpp"

namespace kerf {

// The panels of the overlay that only show something. Each is called between ImGui::NewFrame and
// ImGui::Render; sizes and positions are in pixels, from the upper left corner. Those that return
// an area return that of what they cover, in square pixels.

/// Words of the panels: a label, and its value.
inline const ImVec4 kLabelColour{0.66F, 0.69F, 0.73F, 1.0F};
inline const ImVec4 kValueColour{0.95F, 0.96F, 0.97F, 1.0F};

/// A panel that no mouse touches.
inline constexpr ImGuiWindowFlags kStillPanel =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_AlwaysAutoResize |
    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

/// Height of the letters on a display of 96 dots per inch, in pixels; they are drawn for this.
inline constexpr float kPlainLetters = 13.0F;
/// What a pixel of such a display is here.
[[nodiscard]] inline float unit_px() {
  return ImGui::GetFontSize() / kPlainLetters;
}

/// Between panels, and from a panel to the edge of the picture.
[[nodiscard]] inline float panel_gap() {
  return 12.0F * unit_px();
}

/// Of a name among figures or beside a control, in pixels of such a display.
inline constexpr float kWidestName = 86.0F;

/// A name of the scene, which may be of any length: all of it, or its beginning and two dots,
/// within `most_wide` pixels. No letter is cut.
[[nodiscard]] std::string shortened(const std::string& name, float most_wide);

/// One line of a table with two columns.
template <class Value>
void panel_row(const char* label, const char* format, Value value,
               const ImVec4& colour = kValueColour) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextColored(kLabelColour, "%s", label);
  ImGui::TableNextColumn();
  ImGui::TextColored(colour, format, value);
}

/// Force, tool, score and rates, with the plots if there are any: upper left corner. Returns its
/// size.
ImVec2 draw_figures(const OverlayFigures& figures);

/// Three sections through the tip, one below the other: right edge. `texture` holds them so.
void draw_slices(const SliceViews& slices, ImTextureID texture, ImVec2 size);
/// How wide that panel is.
[[nodiscard]] float width_of_slices(const SliceViews& slices);

/// A list in the upper left corner from which the mouse chooses.
void draw_open_panel(OpenPanel& panel, ImVec2 size, float most_area);

/// At the foot of the picture, beside the controls, which end at `controls_x`; at its top if the
/// picture is too narrow for both. The controls stay where they are under the mouse; no panel lies
/// over the banner.
float draw_banner(const std::string& text, bool alarm, ImVec2 size, float controls_x);

/// The keys and what they do, after those that lead the hand: upper right corner. As many as
/// `most_area` holds; returns of how many such pages this is `page`, counted from 1.
int draw_key_help(ImVec2 size, bool leads_hand, int page, float most_area);

/// A ring where the hand wants to be, a line to the tool that it pulls, and how much deeper that
/// is; behind all panels. The colour shows the force as a fraction of the bar.
void draw_hand_mark(const HandMark& mark, double force_fraction);

/// By the fraction of the full force.
[[nodiscard]] const ImVec4& force_colour(double fraction);

}  // namespace kerf
