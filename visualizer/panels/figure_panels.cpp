// SPDX-License-Identifier: Apache-2.0

#include "visualizer/panels/figure_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "visualizer/panels/key_table.hpp"

namespace kerf {

namespace {

/// Those of the hand first, if one is led.
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

std::string shortened(const std::string& name, float most_wide) {
  const auto fits = [&](const std::string& text) {
    return ImGui::CalcTextSize(text.c_str()).x <= most_wide;
  };
  if (fits(name)) return name;
  const auto continues = [&](std::size_t at) {  // a letter of several bytes
    return (static_cast<unsigned char>(name[at]) & 0xc0U) == 0x80U;
  };
  std::size_t kept = 0;
  for (std::size_t at = 1; at < name.size(); ++at) {
    if (continues(at)) continue;
    if (!fits(name.substr(0, at) + "..")) break;
    kept = at;
  }
  return name.substr(0, kept) + "..";
}

float width_of_slices(const SliceViews& slices) {
  auto wide = static_cast<float>(slices.side);
  for (const char* name : kSliceNames) wide = std::max(wide, ImGui::CalcTextSize(name).x);
  return wide + 2.0F * ImGui::GetStyle().WindowPadding.x;
}

void draw_slices(const SliceViews& slices, ImTextureID texture, ImVec2 size) {
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
  ImGui::End();
}

float draw_banner(const std::string& text, bool alarm, ImVec2 size, float controls_x) {
  const ImVec4 of_alarm{0.45F, 0.20F, 0.0F, 0.92F};
  const ImVec4 of_news{0.05F, 0.20F, 0.32F, 0.92F};
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
  to.AddRectFilled(low, high, ImGui::GetColorU32(alarm ? of_alarm : of_news),
                   ImGui::GetStyle().WindowRounding);
  to.AddText(ImGui::GetFont(), ImGui::GetFontSize(), ImVec2(low.x + padding.x, low.y + padding.y),
             ImGui::GetColorU32(kValueColour), text.c_str(), nullptr, wrap);
  to.PopClipRect();
  return whole.x * whole.y;
}

void draw_hand_mark(const HandMark& mark, double force_fraction) {
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
  const ImU32 colour = ImGui::GetColorU32(force_colour(force_fraction));
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

namespace {

// Okabe and Ito's colours: any kind of colour vision distinguishes them.
const ImVec4 kCalm{0.34F, 0.71F, 0.91F, 1.0F};
const ImVec4 kStrong{0.90F, 0.62F, 0.00F, 1.0F};
const ImVec4 kLimit{0.84F, 0.37F, 0.00F, 1.0F};
const ImVec4 kAlert{1.0F, 0.62F, 0.25F, 1.0F};  // the last, light enough for letters
// Smaller peaks do not fill a plot: noise stays small.
constexpr double kLeastFullForceN = 0.5;
constexpr double kLeastFullDepthMm = 0.1;
constexpr float kWide = 150.0F;
constexpr double kOldMs = 250.0;  // later than this a picture no longer follows the hand
// What keeps it small with any scene.
constexpr std::size_t kMostMaterials = 4, kMostBesideSecond = 2, kFewMaterials = 3;
constexpr float kWidestLabel = 112.0F;

void force_bar(const OverlayFigures& figures) {
  const double fraction = std::clamp(figures.force_n / figures.full_force_n, 0.0, 1.0);
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, force_colour(fraction));
  ImGui::ProgressBar(static_cast<float>(fraction), ImVec2(kWide * unit_px(), 7.0F * unit_px()), "");
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
  const ImVec2 size{kWide * unit_px(), 34.0F * unit_px()};
  ImGui::Dummy(size);
  const float full = std::max(peak, static_cast<float>(least_full));
  std::vector<ImVec2> line;
  for (const ForcePlot::Point& point : points) {
    const double ago_s = static_cast<double>(points.back().time_ns - point.time_ns) * 1e-9;
    const auto along = static_cast<float>(1.0 - ago_s / ForcePlot::kSpanS);
    line.emplace_back(corner.x + size.x * along,
                      corner.y + size.y * (1.0F - std::max(point.*value, 0.0F) / full));
  }
  ImDrawList& to = *ImGui::GetWindowDrawList();
  to.AddRectFilled(corner, ImVec2(corner.x + size.x, corner.y + size.y),
                   ImGui::GetColorU32(ImGuiCol_FrameBg));
  to.AddPolyline(line.data(), static_cast<int>(line.size()), ImGui::GetColorU32(colour),
                 ImDrawFlags_None, 1.5F * unit_px());
}

/// The materials with their colours: what was removed of each.
void material_rows(const OverlayFigures& figures) {
  const std::vector<ScoreRow>& score = figures.score;
  if (!score.empty() && figures.score_is_partial) panel_row("materials", "%s", "since joining");
  const std::size_t most = figures.second ? kMostBesideSecond : kMostMaterials;
  const std::size_t shown = std::min(score.size(), figures.pulp_rise_c ? most - 1 : most);
  for (std::size_t i = 0; i < shown; ++i) {
    const ScoreRow& material = score[i];
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float side = ImGui::GetFontSize();
    const float inset = 0.15F * side;
    ImGui::GetWindowDrawList()->AddRectFilled(
        {corner.x, corner.y + inset}, {corner.x + side - 2.0F * inset, corner.y + side - inset},
        ImGui::GetColorU32(ImVec4(material.red, material.green, material.blue, 1.0F)));
    ImGui::Dummy({side, side});
    ImGui::SameLine(0.0F, 0.0F);
    ImGui::TextColored(kLabelColour, "%s",
                       shortened(material.name, kWidestName * unit_px()).c_str());
    ImGui::TableNextColumn();
    ImGui::TextColored(kValueColour, "%.2f mm3", material.removed_mm3);
  }
  if (shown == score.size()) return;
  double others_mm3 = 0.0;
  for (std::size_t i = shown; i < score.size(); ++i) others_mm3 += score[i].removed_mm3;
  panel_row((std::to_string(score.size() - shown) + " others").c_str(), "%.2f mm3", others_mm3);
}

/// The second arm: its force, and below it tool and state.
void second_arm_rows(const SecondArmFigures& second) {
  panel_row("second arm", "%.2f N", second.force_n);
  panel_row(shortened(second.tool, kWidestName * unit_px()).c_str(), "%s",
            shortened(second.state, kWidestName * unit_px()).c_str(),
            second.alarm ? kAlert : kValueColour);
}

}  // namespace

const ImVec4& force_colour(double fraction) {
  constexpr double kStrongFrom = 0.5;
  constexpr double kLimitFrom = 0.9;
  return fraction < kStrongFrom ? kCalm : fraction < kLimitFrom ? kStrong : kLimit;
}

ImVec2 draw_figures(const OverlayFigures& figures) {
  const float gap = panel_gap();
  ImGui::SetNextWindowPos(ImVec2(gap, gap));
  ImGui::Begin("figures", nullptr, kStillPanel);
  const bool plots = !figures.plot.empty() && !figures.slices;
  if (ImGui::BeginTable("force", 2)) {
    panel_row("force", "%.2f N", figures.force_n);
    ImGui::EndTable();
  }
  force_bar(figures);
  if (ImGui::BeginTable("rows", 2)) {
    const bool listed = figures.controls && figures.controls->tools.size() > 1;
    if (!figures.tool.empty() && !listed) {
      panel_row("tool", "%s", shortened(figures.tool, kWidestName * unit_px()).c_str());
    }
    if (figures.second) second_arm_rows(*figures.second);
    panel_row(figures.score_is_partial ? "since joining" : "removed", "%.2f mm3",
              figures.removed_mm3);
    if (figures.spindle) {
      panel_row("spindle", "%.0f krpm", figures.spindle->krpm);
      panel_row("its load", "%.0f %%", 100.0 * figures.spindle->load);
    }
    if (!plots) material_rows(figures);
    if (!figures.forbidden.empty()) {
      const bool touched = figures.forbidden_ms > 0.0;
      panel_row(shortened("touched " + figures.forbidden, kWidestLabel * unit_px()).c_str(),
                "%.0f ms", figures.forbidden_ms, touched ? kAlert : kValueColour);
    }
    if (figures.pulp_rise_c) {
      panel_row("pulp", "%+.1f C", *figures.pulp_rise_c,
                figures.pulp_harmed ? kAlert : kValueColour);
    }
    const bool has_room =
        figures.score.size() <= kFewMaterials && !figures.second && !figures.pulp_rise_c;
    const bool rates = !figures.slices && !plots && has_room;
    if (rates && figures.tick_rate_hz) panel_row("servo", "%.0f Hz", *figures.tick_rate_hz);
    if (rates && figures.frame_rate_hz) panel_row("picture", "%.0f /s", *figures.frame_rate_hz);
    if (rates && figures.data_age_ms) panel_row("data age", "%.1f ms", *figures.data_age_ms);
    if (figures.picture_age_ms) {
      const bool old = *figures.picture_age_ms > kOldMs;
      panel_row("picture age", "%.0f ms", *figures.picture_age_ms, old ? kAlert : kValueColour);
    }
    if (figures.filmed_frames) {
      panel_row("filmed", "%ju frames", std::uintmax_t{*figures.filmed_frames});
    }
    ImGui::EndTable();
  }
  if (figures.controls) {
    ImGui::TextColored(kLabelColour,
                       figures.leads_hand ? "left button: press; h: keys" : "h: all keys");
  }
  if (plots) {
    curve("force, 5 s, peak", "%.2f N", figures.plot, &ForcePlot::Point::force_n, kLeastFullForceN,
          kCalm);
    curve("depth, 5 s, peak", "%.2f mm", figures.plot, &ForcePlot::Point::penetration_mm,
          kLeastFullDepthMm, kStrong);
  }
  const ImVec2 size = ImGui::GetWindowSize();
  ImGui::End();
  return size;
}

}  // namespace kerf
