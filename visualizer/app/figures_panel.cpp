// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "visualizer/app/overlay_panels.hpp"

namespace kerf {

namespace {

// Okabe and Ito's colours: told apart with any kind of colour vision.
const ImVec4 kCalm{0.34F, 0.71F, 0.91F, 1.0F};
const ImVec4 kStrong{0.90F, 0.62F, 0.00F, 1.0F};
const ImVec4 kLimit{0.84F, 0.37F, 0.00F, 1.0F};
const ImVec4 kAlert{1.0F, 0.62F, 0.25F, 1.0F};  // the last, light enough for letters
// Smaller peaks do not fill a plot: noise stays small.
constexpr double kLeastFullForceN = 0.5;
constexpr double kLeastFullDepthMm = 0.1;
constexpr float kWide = 170.0F;
// What keeps it small with any scene.
constexpr std::size_t kMostMaterials = 4, kFewMaterials = 3, kSpindleRows = 2, kMostLabel = 16,
                      kMostName = 12;

void force_bar(const OverlayFigures& figures) {
  const double share = std::clamp(figures.force_n / figures.full_force_n, 0.0, 1.0);
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, force_colour(share));
  ImGui::ProgressBar(static_cast<float>(share), ImVec2(kWide * unit_px(), 7.0F * unit_px()), "");
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
  const std::size_t few = figures.spindle ? kFewMaterials - kSpindleRows : kFewMaterials;
  const std::size_t most = figures.slices ? few : kMostMaterials;
  if (!score.empty() && figures.score_is_partial) panel_row("materials", "%s", "since joining");
  const std::size_t shown = std::min(score.size(), most);
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
    ImGui::TextColored(kLabelColour, "%s", shortened(material.name, kMostName).c_str());
    ImGui::TableNextColumn();
    ImGui::TextColored(kValueColour, "%.2f mm3", material.removed_mm3);
  }
  if (shown < score.size()) {
    panel_row("and others", "%s", std::to_string(score.size() - shown).c_str());
  }
}

}  // namespace

const ImVec4& force_colour(double share) {
  constexpr double kStrongFrom = 0.5;
  constexpr double kLimitFrom = 0.9;
  return share < kStrongFrom ? kCalm : share < kLimitFrom ? kStrong : kLimit;
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
      panel_row("tool", "%s", shortened(figures.tool, kMostName).c_str());
    }
    panel_row(figures.removed_is_partial ? "since joining" : "removed", "%.2f mm3",
              figures.removed_mm3);
    if (figures.spindle) {
      panel_row("spindle", "%.0f krpm", figures.spindle->krpm);
      panel_row("its load", "%.0f %%", 100.0 * figures.spindle->load);
    }
    if (!plots) material_rows(figures);
    if (!figures.forbidden.empty()) {
      const bool touched = figures.forbidden_ms > 0.0;
      panel_row(shortened("touched " + figures.forbidden, kMostLabel).c_str(), "%.0f ms",
                figures.forbidden_ms, touched ? kAlert : kValueColour);
    }
    const bool rates = !figures.slices && !plots && figures.score.size() <= kFewMaterials;
    if (rates && figures.tick_rate_hz) panel_row("servo", "%.0f Hz", *figures.tick_rate_hz);
    if (rates && figures.frame_rate_hz) panel_row("picture", "%.0f /s", *figures.frame_rate_hz);
    if (rates && figures.data_age_ms) panel_row("data age", "%.1f ms", *figures.data_age_ms);
    if (figures.filmed_frames) {
      panel_row("filmed", "%ju frames", std::uintmax_t{*figures.filmed_frames});
    }
    ImGui::EndTable();
  }
  if (figures.controls) ImGui::TextColored(kLabelColour, "h: all keys");
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
