// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/look_panel.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include <imgui.h>

#include "visualizer/app/overlay_panels.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/renderer_choice.hpp"

namespace kerf {

namespace {

constexpr ImGuiWindowFlags kTouched = (kStillPanel & ~ImGuiWindowFlags_NoInputs) |
                                      ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoNavInputs;
constexpr ImGuiSliderFlags kDragOnly = ImGuiSliderFlags_NoInput | ImGuiSliderFlags_AlwaysClamp;

void choose_gradient(Look& look) {
  auto chosen = static_cast<std::size_t>(look.gradient);
  if (ImGui::BeginCombo("gradient", kGradientNames[chosen].data())) {
    for (std::size_t i = 0; i < kGradientNames.size(); ++i) {
      if (ImGui::Selectable(kGradientNames[i].data(), i == chosen)) chosen = i;
    }
    ImGui::EndCombo();
  }
  look.gradient = static_cast<Gradient>(chosen);
}

void choose_tool(LookControls& controls) {
  if (controls.tools.size() < 2 || controls.tool >= controls.tools.size()) return;
  if (!ImGui::BeginCombo("tool", controls.tools[controls.tool].c_str())) return;
  const std::size_t held = controls.tool;
  for (std::size_t i = 0; i < controls.tools.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));  // two may have one name
    if (ImGui::Selectable(controls.tools[i].c_str(), i == held)) controls.tool = i;
    ImGui::PopID();
  }
  ImGui::EndCombo();
}

/// One for each volume.
void choose_renderers(LookControls& controls) {
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

void choose_opacities(LookControls& controls) {
  Look& look = controls.look;
  ImGui::TextColored(kLabelColour, "opacity of a voxel");
  ImGui::SameLine();
  controls.write = ImGui::SmallButton("write");
  for (const auto& [material, opacity] : controls.opacities) {
    auto value = static_cast<float>(opacity);
    if (ImGui::SliderFloat(material.c_str(), &value, 0.0F, 1.0F, "%.3f",
                           kDragOnly | ImGuiSliderFlags_Logarithmic)) {
      look.opacities[material] = rounded_to(0.001, static_cast<double>(value));
    }
  }
}

void choose_clip_plane(Look& look) {
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
}

}  // namespace

float LookPanel::draw(LookControls& controls, float height) {
  constexpr float kWide = 130.0F;
  ImGui::SetNextWindowPos(ImVec2(12.0F, height - 12.0F), 0, ImVec2(0.0F, 1.0F));
  ImGui::Begin("look", nullptr, kTouched);
  Look& look = controls.look;
  ImGui::PushItemWidth(kWide);
  choose_tool(controls);
  choose_renderers(controls);
  if (controls.takes_gradient) choose_gradient(look);
  if (controls.has_iso) choose_iso(controls);
  if (!controls.opacities.empty()) choose_opacities(controls);
  choose_clip_plane(look);
  ImGui::Checkbox("stereo", &look.stereo.on);
  ImGui::SameLine();
  ImGui::Checkbox("voxel tool", &look.voxel_tool);
  ImGui::PopItemWidth();
  const float end_x = ImGui::GetWindowPos().x + ImGui::GetWindowWidth();
  ImGui::End();
  return end_x;
}

void LookPanel::choose_iso(LookControls& controls) {
  Look& look = controls.look;
  float iso = dragged_iso_.value_or(static_cast<float>(look.iso.value_or(controls.own_iso)));
  if (ImGui::SliderFloat("iso", &iso, 0.02F, 0.98F, "%.2f", kDragOnly)) dragged_iso_ = iso;
  if (ImGui::IsItemDeactivated() && dragged_iso_) {
    look.iso = *dragged_iso_;
    dragged_iso_.reset();
  }
}

double rounded_to(double step, double value) {
  return std::round(value / step) * step;
}

}  // namespace kerf
