// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <imgui.h>

#include "visualizer/app/overlay.hpp"

namespace kerf {

// The panels of the overlay that only show something. Each is called between ImGui::NewFrame and
// ImGui::Render; sizes and places are in pixels, from the upper left corner.

/// Words of the panels: a label, and its value.
inline const ImVec4 kLabelColour{0.66F, 0.69F, 0.73F, 1.0F};
inline const ImVec4 kValueColour{0.95F, 0.96F, 0.97F, 1.0F};

/// A panel that no mouse touches.
inline constexpr ImGuiWindowFlags kStillPanel =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_AlwaysAutoResize |
    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

/// Force, tool, removed volume and rates, with the plots where there are any: upper left corner.
void draw_figures(const OverlayFigures& figures);

/// At the foot of the picture, beside the controls, which end at `controls_x`; at its top where the
/// picture is too narrow for both. The controls stay where they are under the mouse; no panel lies
/// over the banner.
void draw_banner(const std::string& text, bool alarm, ImVec2 size, float controls_x);

/// The keys and what they do, after those that lead the hand: upper right corner.
void draw_key_help(ImVec2 size, bool leads_hand);

/// A ring where the hand wants to be, a line to the tool that it pulls, and how much deeper that
/// is; behind all panels. The colour is that of the force's share of the bar.
void draw_hand_mark(const HandMark& mark, double force_share);

}  // namespace kerf
