// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/overlay.hpp"

#include <algorithm>
#include <cmath>

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include "visualizer/app/overlay_panels.hpp"
#include "visualizer/error.hpp"

namespace kerf {

OverlayFigures OverlayFigures::rounded() const {
  OverlayFigures shown = *this;
  shown.force_n = rounded_to(0.01, force_n);
  shown.removed_mm3 = rounded_to(0.01, removed_mm3);
  if (tick_rate_hz) shown.tick_rate_hz = rounded_to(1.0, *tick_rate_hz);
  if (frame_rate_hz) shown.frame_rate_hz = rounded_to(1.0, *frame_rate_hz);
  if (hand) {
    for (double HandMark::*length : {&HandMark::goal_x, &HandMark::goal_y, &HandMark::tool_x,
                                     &HandMark::tool_y, &HandMark::radius}) {
      (*shown.hand).*length = rounded_to(0.5, (*hand).*length);
    }
    shown.hand->deeper_mm = rounded_to(0.1, hand->deeper_mm);
  }
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
  if (!figures.hidden) draw_figures(figures);
  float controls_x = 0.0F;
  if (figures.controls && !figures.hidden) controls_x = look_panel_.draw(*figures.controls, all.y);
  if (figures.hand) draw_hand_mark(*figures.hand, figures.force_n / figures.full_force_n);
  if (figures.help) draw_key_help(all, figures.leads_hand);
  if (!figures.banner.empty()) draw_banner(figures.banner, figures.alarm, all, controls_x);
  ImGui::Render();
}

PixelRect Overlay::prepare(const OverlayFigures& figures, PictureSize size) {
  ImGui_ImplOpenGL3_NewFrame();
  OverlayFigures shown = figures;
  // ImGui learns the size of what a panel holds by laying it out: the second time is right.
  for (int pass = 0; pass < 2; ++pass) lay_out(shown, size);
  PixelRect bounds;
  const ImDrawData& panels = *ImGui::GetDrawData();
  for (int i = 0; i < panels.CmdListsCount; ++i) {
    for (ImDrawCmd& command : panels.CmdLists[i]->CmdBuffer) {
      ImVec4& clip = command.ClipRect;                            // from the upper left corner
      clip.z = std::min(clip.z, static_cast<float>(size.width));  // the other eye's begins there
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
