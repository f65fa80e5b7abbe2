// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/overlay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include "visualizer/app/keys.hpp"
#include "visualizer/error.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/renderer_choice.hpp"

namespace kerf {

namespace {

// Okabe and Ito's colours: told apart with any kind of colour vision.
const ImVec4 kCalm{0.34F, 0.71F, 0.91F, 1.0F};
const ImVec4 kStrong{0.90F, 0.62F, 0.00F, 1.0F};
const ImVec4 kLimit{0.84F, 0.37F, 0.00F, 1.0F};
const ImVec4 kLabel{0.66F, 0.69F, 0.73F, 1.0F};
const ImVec4 kValue{0.95F, 0.96F, 0.97F, 1.0F};
// Smaller peaks do not fill a plot: noise stays small.
constexpr double kLeastFullForceN = 0.5;
constexpr double kLeastFullDepthMm = 0.1;
constexpr ImGuiWindowFlags kStill =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_AlwaysAutoResize |
    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

constexpr ImGuiWindowFlags kTouched =
    (kStill & ~ImGuiWindowFlags_NoInputs) | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoNavInputs;

void row(const char* label, const char* format, double value) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextColored(kLabel, "%s", label);
  ImGui::TableNextColumn();
  ImGui::TextColored(kValue, format, value);
}

void row(const char* label, const std::string& value) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextColored(kLabel, "%s", label);
  ImGui::TableNextColumn();
  ImGui::TextColored(kValue, "%s", value.c_str());
}

void force_bar(const OverlayFigures& figures) {
  const auto share =
      static_cast<float>(std::clamp(figures.force_n / figures.full_force_n, 0.0, 1.0));
  constexpr float kStrongFrom = 0.5F;
  constexpr float kLimitFrom = 0.9F;
  const ImVec4& colour = share < kStrongFrom ? kCalm : share < kLimitFrom ? kStrong : kLimit;
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, colour);
  ImGui::ProgressBar(share, ImVec2(170.0F, 7.0F), "");
  ImGui::PopStyleColor();
}

/// One quantity over the last seconds, from 0 to its peak, but at least to `least_full`.
void curve(const char* label, const char* format, const std::vector<ForcePlot::Point>& points,
           float ForcePlot::Point::*value, double least_full, const ImVec4& colour) {
  float peak = 0.0F;
  for (const ForcePlot::Point& point : points) peak = std::max(peak, point.*value);
  ImGui::TextColored(kLabel, "%s", label);
  ImGui::SameLine();
  ImGui::TextColored(kValue, format, static_cast<double>(peak));
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

void panel(const OverlayFigures& figures) {
  ImGui::SetNextWindowPos(ImVec2(12.0F, 12.0F));
  ImGui::Begin("figures", nullptr, kStill);
  if (ImGui::BeginTable("force", 2)) {
    row("force", "%.2f N", figures.force_n);
    ImGui::EndTable();
  }
  force_bar(figures);
  if (ImGui::BeginTable("rows", 2)) {
    if (!figures.tool.empty()) row("tool", figures.tool);
    row(figures.removed_is_partial ? "removed since joining" : "removed", "%.2f mm3",
        figures.removed_mm3);
    if (figures.tick_rate_hz) row("servo", "%.0f Hz", *figures.tick_rate_hz);
    if (figures.frame_rate_hz) row("picture", "%.0f /s", *figures.frame_rate_hz);
    if (figures.data_age_ms) row("data age", "%.1f ms", *figures.data_age_ms);
    if (figures.filmed_frames) row("filmed", std::to_string(*figures.filmed_frames) + " frames");
    ImGui::EndTable();
  }
  if (!figures.plot.empty()) {
    curve("force, 5 s, peak", "%.2f N", figures.plot, &ForcePlot::Point::force_n, kLeastFullForceN,
          kCalm);
    curve("depth, 5 s, peak", "%.2f mm", figures.plot, &ForcePlot::Point::penetration_mm,
          kLeastFullDepthMm, kStrong);
  }
  ImGui::End();
}

/// At the foot of the picture, beside the controls, which end at `controls_x`; at its top where the
/// picture is too narrow for both. The controls stay where they are under the mouse; no panel lies
/// over the banner.
void banner(const std::string& text, bool alarm, ImVec2 size, float controls_x) {
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
             ImGui::GetColorU32(kValue), text.c_str(), nullptr, wrap);
  to.PopClipRect();
}

void key_help(ImVec2 size) {
  ImGui::SetNextWindowPos(ImVec2(size.x - 12.0F, 12.0F), 0, ImVec2(1.0F, 0.0F));
  ImGui::SetNextWindowBgAlpha(0.9F);  // many words over whatever is behind
  ImGui::Begin("keys", nullptr, kStill);
  if (ImGui::BeginTable("keys", 2)) {
    for (const auto& [key, meaning] : kKeys) row(key, std::string(meaning));
    ImGui::EndTable();
  }
  ImGui::End();
}

/// One for each volume.
void renderer_controls(LookControls& controls) {
  const std::size_t count = controls.volumes.size();
  const std::vector<std::string> now = renderer_of_each(controls.look.renderer, count);
  for (std::size_t v = 0; v < count; ++v) {
    ImGui::PushID(static_cast<int>(v));
    const std::string label = count == 1 ? "renderer" : controls.volumes[v];
    if (ImGui::BeginCombo(label.c_str(), now[v].c_str())) {
      for (const std::string_view kind : renderer_kinds()) {
        const std::string name(kind);
        if (!ImGui::Selectable(name.c_str(), now[v] == name)) continue;
        controls.look.renderer = with_renderer(controls.look.renderer, count, v, name);
      }
      ImGui::EndCombo();
    }
    ImGui::PopID();
  }
}

double rounded_to(double step, double value) {
  return std::round(value / step) * step;
}

}  // namespace

OverlayFigures OverlayFigures::rounded() const {
  OverlayFigures shown = *this;
  shown.force_n = rounded_to(0.01, force_n);
  shown.removed_mm3 = rounded_to(0.01, removed_mm3);
  if (tick_rate_hz) shown.tick_rate_hz = rounded_to(1.0, *tick_rate_hz);
  if (frame_rate_hz) shown.frame_rate_hz = rounded_to(1.0, *frame_rate_hz);
  if (data_age_ms) shown.data_age_ms = rounded_to(0.1, *data_age_ms);
  return shown;
}

Overlay::Overlay() {
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // leaves no file behind
  ImGuiStyle& style = ImGui::GetStyle();
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = 5.0F;
  style.FrameRounding = 3.0F;
  style.WindowBorderSize = 0.0F;
  style.WindowPadding = ImVec2(11.0F, 9.0F);
  style.CellPadding = ImVec2(4.0F, 1.5F);
  style.Colors[ImGuiCol_WindowBg] = ImVec4(0.04F, 0.05F, 0.06F, 0.72F);
  style.Colors[ImGuiCol_FrameBg] = ImVec4(1.0F, 1.0F, 1.0F, 0.12F);
  // Dark enough for the digits that stand on it.
  style.Colors[ImGuiCol_SliderGrab] = ImVec4(0.12F, 0.34F, 0.50F, 1.0F);
  style.Colors[ImGuiCol_SliderGrabActive] = ImVec4(0.16F, 0.42F, 0.60F, 1.0F);
  if (!ImGui_ImplOpenGL3_Init("#version 450 core")) {
    ImGui::DestroyContext();
    throw VisualizerError("overlay: Dear ImGui finds no OpenGL functions; install libgl1");
  }
}

Overlay::~Overlay() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext();
}

bool Overlay::handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size) {
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = ImVec2(static_cast<float>(pointer.x), static_cast<float>(pointer.y));
  io.MouseDown[0] = pointer.down;
  ImGui_ImplOpenGL3_NewFrame();
  lay_out(figures, size);
  if (figures.controls && io.WantCaptureMouse) figures.controls->over = pointer;
  return io.WantCaptureMouse;
}

void Overlay::lay_out(OverlayFigures& figures, PictureSize size) {
  const ImVec2 all{static_cast<float>(size.width), static_cast<float>(size.height)};
  ImGui::GetIO().DisplaySize = all;
  ImGui::NewFrame();
  if (!figures.hidden) panel(figures);
  float controls_x = 0.0F;
  if (figures.controls && !figures.hidden) {
    ImGui::SetNextWindowPos(ImVec2(12.0F, all.y - 12.0F), 0, ImVec2(0.0F, 1.0F));
    ImGui::Begin("look", nullptr, kTouched);
    look_controls(*figures.controls);
    controls_x = ImGui::GetWindowPos().x + ImGui::GetWindowWidth();
    ImGui::End();
  }
  if (figures.help) key_help(all);
  if (!figures.banner.empty()) banner(figures.banner, figures.alarm, all, controls_x);
  ImGui::Render();
}

void Overlay::look_controls(LookControls& controls) {
  constexpr float kWide = 130.0F;
  constexpr ImGuiSliderFlags kDragOnly = ImGuiSliderFlags_NoInput | ImGuiSliderFlags_AlwaysClamp;
  Look& look = controls.look;
  ImGui::PushItemWidth(kWide);
  renderer_controls(controls);
  if (controls.takes_gradient) {
    auto chosen = static_cast<std::size_t>(look.gradient);
    if (ImGui::BeginCombo("gradient", kGradientNames[chosen].data())) {
      for (std::size_t i = 0; i < kGradientNames.size(); ++i) {
        if (ImGui::Selectable(kGradientNames[i].data(), i == chosen)) chosen = i;
      }
      ImGui::EndCombo();
    }
    look.gradient = static_cast<Gradient>(chosen);
  }
  if (controls.has_iso) {
    float iso = dragged_iso_.value_or(static_cast<float>(look.iso.value_or(controls.own_iso)));
    if (ImGui::SliderFloat("iso", &iso, 0.02F, 0.98F, "%.2f", kDragOnly)) dragged_iso_ = iso;
    if (ImGui::IsItemDeactivated() && dragged_iso_) {
      look.iso = *dragged_iso_;
      dragged_iso_.reset();
    }
  }
  if (!controls.opacities.empty()) {
    ImGui::TextColored(kLabel, "opacity of a voxel");
    ImGui::SameLine();
    controls.write = ImGui::SmallButton("write");
  }
  for (const auto& [material, opacity] : controls.opacities) {
    auto value = static_cast<float>(opacity);
    if (ImGui::SliderFloat(material.c_str(), &value, 0.0F, 1.0F, "%.3f",
                           kDragOnly | ImGuiSliderFlags_Logarithmic)) {
      look.opacities[material] = rounded_to(0.001, static_cast<double>(value));
    }
  }
  ImGui::Checkbox("clip", &look.clip.on);
  if (look.clip.on) {
    constexpr std::array kAxes{"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
      ImGui::SameLine();
      ImGui::RadioButton(kAxes[static_cast<std::size_t>(axis)], &look.clip.axis, axis);
    }
    auto at = static_cast<float>(look.clip.at);
    if (ImGui::SliderFloat("plane", &at, 0.0F, 1.0F, "%.2f", kDragOnly)) look.clip.at = at;
  }
  ImGui::Checkbox("stereo", &look.stereo.on);
  ImGui::SameLine();
  ImGui::Checkbox("voxel tool", &look.voxel_tool);
  ImGui::PopItemWidth();
}

PixelRect Overlay::prepare(const OverlayFigures& figures, PictureSize size) {
  ImGui_ImplOpenGL3_NewFrame();
  OverlayFigures shown = figures;
  // ImGui learns the size of what a panel holds by laying it out: the second time is right.
  for (int pass = 0; pass < 2; ++pass) lay_out(shown, size);
  PixelRect bounds;
  const ImDrawData& panels = *ImGui::GetDrawData();
  for (int i = 0; i < panels.CmdListsCount; ++i) {
    for (const ImDrawCmd& command : panels.CmdLists[i]->CmdBuffer) {
      const ImVec4& clip = command.ClipRect;  // from the upper left corner
      bounds = bounds.united(PixelRect{
          static_cast<int>(std::floor(clip.x)), size.height - static_cast<int>(std::ceil(clip.w)),
          static_cast<int>(std::ceil(clip.z)), size.height - static_cast<int>(std::floor(clip.y))});
    }
  }
  return bounds;
}

void Overlay::draw(const RenderTarget& target, int eyes) {
  target.bind();
  ImDrawData& panels = *ImGui::GetDrawData();
  panels.DisplaySize.x = static_cast<float>(target.size().width);
  const int eye_width = target.size().width / eyes;
  for (int eye = 0; eye < eyes; ++eye) {
    panels.DisplayPos.x = static_cast<float>(-eye * eye_width);
    ImGui_ImplOpenGL3_RenderDrawData(&panels);
  }
}

}  // namespace kerf
