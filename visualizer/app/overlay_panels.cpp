// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/overlay_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <vector>

#include "visualizer/app/keys.hpp"

namespace kerf {

namespace {

/// Those of the hand first, where one is led.
std::vector<KeyHelp> keys_of(bool leads_hand) {
  std::vector<KeyHelp> keys;
  if (leads_hand) keys.assign(kHandKeys.begin(), kHandKeys.end());
  // The first ones are the mouse's, which leads the hand.
  const std::size_t from = leads_hand ? kMouseKeys : 0;
  keys.insert(keys.end(), kKeys.begin() + static_cast<std::ptrdiff_t>(from), kKeys.end());
  return keys;
}

/// Of a table of all of them, and its height per row.
ImVec2 size_of_row(const std::vector<KeyHelp>& keys) {
  float key = 0.0F, meaning = 0.0F;
  for (const KeyHelp& one : keys) {
    key = std::max(key, ImGui::CalcTextSize(one.key).x);
    meaning = std::max(meaning, ImGui::CalcTextSize(one.meaning).x);
  }
  const ImVec2 cell = ImGui::GetStyle().CellPadding;
  return {key + meaning + 4.0F * cell.x + 2.0F * ImGui::GetStyle().WindowPadding.x,
          ImGui::GetTextLineHeight() + 2.0F * cell.y};
}

}  // namespace

float width_of_slices(const SliceViews& slices) {
  auto wide = static_cast<float>(slices.side);
  for (const char* name : kSliceNames) wide = std::max(wide, ImGui::CalcTextSize(name).x);
  return wide + 2.0F * ImGui::GetStyle().WindowPadding.x;
}

float draw_slices(const SliceViews& slices, ImTextureID texture, ImVec2 size) {
  const float gap = panel_gap();
  ImGui::SetNextWindowPos(ImVec2(size.x - gap, gap), 0, ImVec2(1.0F, 0.0F));
  ImGui::Begin("slices", nullptr, kStillPanel);
  const auto side = static_cast<float>(slices.side);
  for (std::size_t i = 0; i < kSliceNames.size(); ++i) {
    ImGui::TextColored(kLabelColour, "%s", kSliceNames[i]);
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const auto third = [](std::size_t k) { return static_cast<float>(k) / kSliceNames.size(); };
    ImGui::Image(texture, {side, side}, {0.0F, third(i)}, {1.0F, third(i + 1)});
    const auto& [right, down] = slices.tip[i];
    if (right < 0.0 || right > 1.0 || down < 0.0 || down > 1.0) continue;
    const ImVec2 tip{std::floor(corner.x + side * static_cast<float>(right)) + 0.5F,
                     std::floor(corner.y + side * static_cast<float>(down)) + 0.5F};
    const ImU32 colour = ImGui::GetColorU32(ImVec4(1.0F, 1.0F, 1.0F, 0.55F));
    ImDrawList& to = *ImGui::GetWindowDrawList();
    to.AddLine({corner.x, tip.y}, {corner.x + side, tip.y}, colour);
    to.AddLine({tip.x, corner.y}, {tip.x, corner.y + side}, colour);
  }
  const float area = area_of_panel();
  ImGui::End();
  return area;
}

float draw_banner(const std::string& text, bool alarm, ImVec2 size, float controls_x) {
  const ImVec4 kAlarm{0.45F, 0.20F, 0.0F, 0.92F};
  const ImVec4 kNews{0.05F, 0.20F, 0.32F, 0.92F};
  const float gap = 8.0F * unit_px(), foot = 14.0F * unit_px(), least_wide = 160.0F * unit_px();
  const ImVec2 padding = ImGui::GetStyle().WindowPadding;
  const bool alone = controls_x <= 0.0F;
  const bool beside = size.x - controls_x - 2.0F * gap >= least_wide;
  const float left = beside && !alone ? controls_x + gap : 0.05F * size.x;
  const float right = beside && !alone ? size.x - gap : 0.95F * size.x;
  const float wrap = std::max(right - left - 2.0F * padding.x, 60.0F * unit_px());
  const ImVec2 words = ImGui::CalcTextSize(text.c_str(), nullptr, false, wrap);
  const ImVec2 whole{words.x + 2.0F * padding.x, words.y + 2.0F * padding.y};
  const float top = alone || beside ? size.y - foot - whole.y : gap;
  const ImVec2 low{std::floor(0.5F * (left + right - whole.x)), std::floor(std::max(top, 0.0F))};
  const ImVec2 high{low.x + whole.x, low.y + whole.y};
  ImDrawList& to = *ImGui::GetForegroundDrawList();
  to.PushClipRect(low, high);
  to.AddRectFilled(low, high, ImGui::GetColorU32(alarm ? kAlarm : kNews),
                   ImGui::GetStyle().WindowRounding);
  to.AddText(ImGui::GetFont(), ImGui::GetFontSize(), ImVec2(low.x + padding.x, low.y + padding.y),
             ImGui::GetColorU32(kValueColour), text.c_str(), nullptr, wrap);
  to.PopClipRect();
  return whole.x * whole.y;
}

void draw_hand_mark(const HandMark& mark, double force_share) {
  const float least_radius = 4.0F * unit_px(), most_radius = 60.0F * unit_px();
  const float wide = 1.8F * unit_px(), dot = 2.0F * unit_px();
  constexpr double kLeastDepthMm = 0.1;
  const ImVec2 goal{static_cast<float>(mark.goal_x), static_cast<float>(mark.goal_y)};
  const ImVec2 tool{static_cast<float>(mark.tool_x), static_cast<float>(mark.tool_y)};
  const float radius = std::clamp(static_cast<float>(mark.radius), least_radius, most_radius);
  const std::array<char, 32> depth = [&] {
    std::array<char, 32> text{};
    if (std::abs(mark.deeper_mm) >= kLeastDepthMm) {
      std::snprintf(text.data(), text.size(), "%.1f mm %s", std::abs(mark.deeper_mm),
                    mark.deeper_mm > 0.0 ? "deeper" : "nearer");
    }
    return text;
  }();
  const ImVec2 words = ImGui::CalcTextSize(depth.data());
  const ImVec2 at{goal.x + radius + 5.0F, goal.y - 0.5F * words.y};
  const ImVec2 low{std::min(goal.x - radius, tool.x) - 3.0F * unit_px(),
                   std::min(goal.y - radius, tool.y) - 8.0F * unit_px()};
  const ImVec2 high{std::max(at.x + words.x, tool.x) + 3.0F * unit_px(),
                    std::max(goal.y + radius, tool.y) + 8.0F * unit_px()};
  const ImU32 colour = ImGui::GetColorU32(force_colour(force_share));
  ImDrawList& to = *ImGui::GetBackgroundDrawList();
  to.PushClipRect({std::max(low.x, 0.0F), low.y}, high);  // left of it may be another eye's
  to.AddLine(tool, goal, colour, wide);
  to.AddCircle(goal, radius, colour, 0, wide);
  to.AddCircleFilled(goal, dot, colour);
  if (depth.front() != '\0') {  // a light solid may lie behind it
    const float edge = 2.0F * unit_px();
    to.AddRectFilled({at.x - edge, at.y}, {at.x + words.x + edge, at.y + words.y},
                     ImGui::GetColorU32(ImGuiCol_WindowBg), edge);
    to.AddText(at, ImGui::GetColorU32(kValueColour), depth.data());
  }
  to.PopClipRect();
}

int draw_key_help(ImVec2 size, bool leads_hand, int page, float most_area) {
  constexpr float kLeastRows = 3.0F;
  const std::vector<KeyHelp> keys = keys_of(leads_hand);
  const float gap = 12.0F * unit_px();
  const ImVec2 row = size_of_row(keys);
  const float around = 2.0F * ImGui::GetStyle().WindowPadding.y + row.y;  // and which page it is
  const float high = std::min(most_area / row.x, size.y - 2.0F * gap);
  const auto rows = static_cast<std::size_t>(std::max((high - around) / row.y, kLeastRows));
  const std::size_t pages = (keys.size() + rows - 1) / rows;
  const std::size_t now = std::min(static_cast<std::size_t>(page), pages);
  const std::size_t each = (keys.size() + pages - 1) / pages;
  ImGui::SetNextWindowPos(ImVec2(size.x - gap, gap), 0, ImVec2(1.0F, 0.0F));
  ImGui::SetNextWindowBgAlpha(0.9F);  // many words over whatever is behind
  ImGui::Begin("keys", nullptr, kStillPanel);
  if (ImGui::BeginTable("keys", 2)) {
    for (std::size_t i = (now - 1) * each; i < std::min(now * each, keys.size()); ++i) {
      panel_row(keys[i].key, "%s", keys[i].meaning);
    }
    ImGui::EndTable();
  }
  if (now < pages) ImGui::TextColored(kLabelColour, "h: more keys");
  ImGui::End();
  return static_cast<int>(pages);
}

}  // namespace kerf
