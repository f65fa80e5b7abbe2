// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "visualizer/app/overlay_panels.hpp"

namespace kerf {

void draw_open_panel(OpenPanel& panel, ImVec2 size, float most_area) {
  const float gap = 12.0F * unit_px();
  // Twice as wide as high: names are long.
  const float high = std::min(std::sqrt(0.5F * most_area), size.y - 2.0F * gap);
  const float wide = std::min(2.0F * high, size.x - 2.0F * gap);
  ImGui::SetNextWindowPos(ImVec2(gap, gap));
  ImGui::SetNextWindowSize(ImVec2(wide, high));
  constexpr ImGuiWindowFlags kFlags =
      (kStillPanel & ~(ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_AlwaysAutoResize)) |
      ImGuiWindowFlags_NoMove;
  ImGui::SetNextWindowBgAlpha(0.9F);
  ImGui::Begin("open", nullptr, kFlags);
  ImGui::TextColored(kLabelColour, "open a scene or a volume; o: leave");
  ImGui::TextColored(kValueColour, "%s", panel.list.folder.c_str());
  ImGui::PushTextWrapPos(0.0F);
  if (!panel.list.note.empty()) ImGui::TextColored(kLabelColour, "%s", panel.list.note.c_str());
  ImGui::PopTextWrapPos();
  ImGui::BeginChild("entries");
  ImGuiListClipper shown;
  shown.Begin(static_cast<int>(panel.list.entries.size()));
  while (shown.Step()) {
    for (int i = shown.DisplayStart; i < shown.DisplayEnd; ++i) {
      const FolderList::Entry& entry = panel.list.entries[static_cast<std::size_t>(i)];
      ImGui::PushID(i);
      if (ImGui::Selectable((entry.name + (entry.is_folder ? "/" : "")).c_str())) {
        panel.chosen = static_cast<std::size_t>(i);
      }
      ImGui::PopID();
    }
  }
  ImGui::EndChild();
  ImGui::End();
}

}  // namespace kerf
