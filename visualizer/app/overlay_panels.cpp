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

// Okabe and Ito's colours: told apart with any kind of colour vision.
const ImVec4 kCalm{0.34F, 0.71F, 0.91F, 1.0F};
const ImVec4 kStrong{0.90F, 0.62F, 0.00F, 1.0F};
const ImVec4 kLimit{0.84F, 0.37F, 0.00F, 1.0F};
// Smaller peaks do not fill a plot: noise stays small.
constexpr double kLeastFullForceN = 0.5;
constexpr double kLeastFullDepthMm = 0.1;

template <class Value>
void row(const char* label, const char* format, Value value) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextColored(kLabelColour, "%s", label);
  ImGui::TableNextColumn();
  ImGui::TextColored(kValueColour, format, value);
}

/// Of a share of the full force.
const ImVec4& colour_of(double share) {
  constexpr double kStrongFrom = 0.5;
  constexpr double kLimitFrom = 0.9;
  return share < kStrongFrom ? kCalm : share < kLimitFrom ? kStrong : kLimit;
}

void force_bar(const OverlayFigures& figures) {
  const double share = std::clamp(figures.force_n / figures.full_force_n, 0.0, 1.0);
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, colour_of(share));
  ImGui::ProgressBar(static_cast<float>(share), ImVec2(170.0F, 7.0F), "");
  ImGui::PopStyleColor();
}

/// One quantity over the last seconds, from 0 to its peak, but at least to `least_full`.
void curve(const char* label, const char* format, const std::vector<ForcePlot::Point>& points,
           float ForcePlot::Point::*value, double least_full, const ImVec4& colour) {
  float peak = 0.0F;
  for (const ForcePlot::Point& point : points) peak = std::max(peak, point.*value);
  ImGui::TextColored(kLabelColour, "%s", label);
  ImGui::SameLine();
  ImGui::TextColored(kValueColour, format, static_cast<double>(peak));
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 kSize{170.0F, 44.0F};
  ImGui::Dummy(kSize);
  const float full = std::max(peak, static_cast<float>(least_full));
  std::vector<ImVec2> line;
  for (const ForcePlot::Point& point : points) {
    const double ago_s = static_cast<double>(points.back().time_ns - point.time_ns) * 1e-9;
    const auto along = static_cast<float>(1.0 - ago_s / ForcePlot::kSpanS);
    line.emplace_back(corner.x + kSize.x * along,
                      corner.y + kSize.y * (1.0F - std::max(point.*value, 0.0F) / full));
  }
  ImDrawList& to = *ImGui::GetWindowDrawList();
  to.AddRectFilled(corner, ImVec2(corner.x + kSize.x, corner.y + kSize.y),
                   ImGui::GetColorU32(ImGuiCol_FrameBg));
  to.AddPolyline(line.data(), static_cast<int>(line.size()), ImGui::GetColorU32(colour),
                 ImDrawFlags_None, 1.5F);
}

}  // namespace

void draw_figures(const OverlayFigures& figures) {
  ImGui::SetNextWindowPos(ImVec2(12.0F, 12.0F));
  ImGui::Begin("figures", nullptr, kStillPanel);
  if (ImGui::BeginTable("force", 2)) {
    row("force", "%.2f N", figures.force_n);
    ImGui::EndTable();
  }
  force_bar(figures);
  if (ImGui::BeginTable("rows", 2)) {
    if (!figures.tool.empty()) row("tool", "%s", figures.tool.c_str());
    row(figures.removed_is_partial ? "removed since joining" : "removed", "%.2f mm3",
        figures.removed_mm3);
    if (figures.tick_rate_hz) row("servo", "%.0f Hz", *figures.tick_rate_hz);
    if (figures.frame_rate_hz) row("picture", "%.0f /s", *figures.frame_rate_hz);
    if (figures.data_age_ms) row("data age", "%.1f ms", *figures.data_age_ms);
    if (figures.filmed_frames) row("filmed", "%ju frames", std::uintmax_t{*figures.filmed_frames});
    ImGui::EndTable();
  }
  if (figures.controls && !figures.help) ImGui::TextColored(kLabelColour, "h: all keys");
  if (!figures.plot.empty()) {
    curve("force, 5 s, peak", "%.2f N", figures.plot, &ForcePlot::Point::force_n, kLeastFullForceN,
          kCalm);
    curve("depth, 5 s, peak", "%.2f mm", figures.plot, &ForcePlot::Point::penetration_mm,
          kLeastFullDepthMm, kStrong);
  }
  ImGui::End();
}

void draw_banner(const std::string& text, bool alarm, ImVec2 size, float controls_x) {
  const ImVec4 kAlarm{0.45F, 0.20F, 0.0F, 0.92F};
  const ImVec4 kNews{0.05F, 0.20F, 0.32F, 0.92F};
  constexpr float kGap = 8.0F, kFoot = 14.0F, kLeastWide = 160.0F;
  const ImVec2 padding = ImGui::GetStyle().WindowPadding;
  const bool alone = controls_x <= 0.0F;
  const bool beside = size.x - controls_x - 2.0F * kGap >= kLeastWide;
  const float left = beside && !alone ? controls_x + kGap : 0.05F * size.x;
  const float right = beside && !alone ? size.x - kGap : 0.95F * size.x;
  const float wrap = std::max(right - left - 2.0F * padding.x, 60.0F);
  const ImVec2 words = ImGui::CalcTextSize(text.c_str(), nullptr, false, wrap);
  const ImVec2 whole{words.x + 2.0F * padding.x, words.y + 2.0F * padding.y};
  const float top = alone || beside ? size.y - kFoot - whole.y : kGap;
  const ImVec2 low{std::floor(0.5F * (left + right - whole.x)), std::floor(std::max(top, 0.0F))};
  const ImVec2 high{low.x + whole.x, low.y + whole.y};
  ImDrawList& to = *ImGui::GetForegroundDrawList();
  to.PushClipRect(low, high);
  to.AddRectFilled(low, high, ImGui::GetColorU32(alarm ? kAlarm : kNews),
                   ImGui::GetStyle().WindowRounding);
  to.AddText(ImGui::GetFont(), ImGui::GetFontSize(), ImVec2(low.x + padding.x, low.y + padding.y),
             ImGui::GetColorU32(kValueColour), text.c_str(), nullptr, wrap);
  to.PopClipRect();
}

void draw_hand_mark(const HandMark& mark, double force_share) {
  constexpr float kLeastRadius = 4.0F, kMostRadius = 60.0F, kWide = 1.8F, kDot = 2.0F;
  constexpr double kLeastDepthMm = 0.1;
  const ImVec2 goal{static_cast<float>(mark.goal_x), static_cast<float>(mark.goal_y)};
  const ImVec2 tool{static_cast<float>(mark.tool_x), static_cast<float>(mark.tool_y)};
  const float radius = std::clamp(static_cast<float>(mark.radius), kLeastRadius, kMostRadius);
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
  const ImVec2 low{std::min(goal.x - radius, tool.x) - 3.0F,
                   std::min(goal.y - radius, tool.y) - 8.0F};
  const ImVec2 high{std::max(at.x + words.x, tool.x) + 3.0F,
                    std::max(goal.y + radius, tool.y) + 8.0F};
  const ImU32 colour = ImGui::GetColorU32(colour_of(force_share));
  ImDrawList& to = *ImGui::GetBackgroundDrawList();
  to.PushClipRect({std::max(low.x, 0.0F), low.y}, high);  // left of it may be another eye's
  to.AddLine(tool, goal, colour, kWide);
  to.AddCircle(goal, radius, colour, 0, kWide);
  to.AddCircleFilled(goal, kDot, colour);
  to.AddText(at, ImGui::GetColorU32(kValueColour), depth.data());
  to.PopClipRect();
}

void draw_key_help(ImVec2 size, bool leads_hand) {
  ImGui::SetNextWindowPos(ImVec2(size.x - 12.0F, 12.0F), 0, ImVec2(1.0F, 0.0F));
  ImGui::SetNextWindowBgAlpha(0.9F);  // many words over whatever is behind
  ImGui::Begin("keys", nullptr, kStillPanel);
  if (ImGui::BeginTable("keys", 2)) {
    if (leads_hand) {
      for (const auto& [key, meaning] : kHandKeys) row(key, "%s", meaning);
      ImGui::TableNextRow(ImGuiTableRowFlags_None, 6.0F);
    }
    // The first ones are the mouse's, which leads the hand.
    const std::size_t from = leads_hand ? kMouseKeys : 0;
    for (std::size_t i = from; i < kKeys.size(); ++i) row(kKeys[i].key, "%s", kKeys[i].meaning);
    ImGui::EndTable();
  }
  ImGui::End();
}

}  // namespace kerf
