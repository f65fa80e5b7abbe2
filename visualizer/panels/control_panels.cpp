// SPDX-License-Identifier: Apache-2.0

#include "visualizer/panels/control_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <string_view>
#include <system_error>

#include <imgui.h>

#include "shared/posix/atomic_file.hpp"
#include "visualizer/panels/figure_panels.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

namespace {

namespace fs = std::filesystem;

// As `kerf volume` reads them; a folder of slices is no file, and is given to ./kerf demo --volume.
constexpr std::array<std::string_view, 9> kVolumes{".nrrd", ".nhdr", ".mha",  ".mhd", ".nii",
                                                   ".gz",   ".tif",  ".tiff", ".dcm"};
constexpr std::string_view kScene = ".toml";
constexpr int kMostLooked = 100'000;  // in a folder of more the rest is left out

bool is_volume(const fs::path& file) {
  return std::ranges::find(kVolumes, ending_of(file)) != kVolumes.end();
}

}  // namespace

FolderList list_folder(const fs::path& folder) {
  std::error_code problem;
  FolderList list;
  list.folder = fs::absolute(folder, problem).lexically_normal();
  if (problem) list.folder = folder;
  if (list.folder.filename().empty())
    list.folder = list.folder.parent_path();  // a slash at the end
  if (list.folder.has_parent_path() && list.folder != list.folder.root_path()) {
    list.entries.push_back({"..", true});
  }
  const std::size_t above = list.entries.size();
  fs::directory_iterator at(list.folder, problem);
  int looked = 0;
  for (; !problem && at != fs::directory_iterator() && looked < kMostLooked;
       at.increment(problem), ++looked) {
    const std::string name = at->path().filename().string();
    if (name.starts_with('.')) continue;
    std::error_code unknown;  // a link to nothing is neither
    const bool is_folder = at->is_directory(unknown);
    const bool is_file = at->is_regular_file(unknown);
    const bool opens = ending_of(name) == kScene || is_volume(name);
    if (is_folder || (is_file && opens)) list.entries.push_back({name, is_folder});
  }
  std::sort(list.entries.begin() + static_cast<std::ptrdiff_t>(above), list.entries.end(),
            [](const FolderList::Entry& a, const FolderList::Entry& b) {
              return a.is_folder != b.is_folder ? a.is_folder : a.name < b.name;
            });
  if (problem) {
    list.note = list.folder.string() + ": " + problem.message() + "; choose another folder";
  } else if (list.entries.size() > FolderList::kMost || looked == kMostLooked) {
    const std::size_t all = list.entries.size();
    list.entries.resize(std::min(all, FolderList::kMost));
    list.note = list.folder.string() + ": " + std::to_string(list.entries.size()) + " of " +
                std::to_string(all) + " entries or more; give ./kerf demo the one you want";
  } else if (list.entries.size() == above) {
    list.note = list.folder.string() + ": no scene (.toml) and no volume; choose another folder";
  }
  return list;
}

std::string why_not_open(const fs::path& file) {
  if (is_volume(file)) return {};
  std::ifstream text(file);
  if (!text) return file.string() + ": cannot be read; choose another file";
  constexpr int kMostLines = 100'000;
  std::string line;
  for (int i = 0; i < kMostLines && std::getline(text, line); ++i) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin != std::string::npos && line.compare(begin, 10, "[[volume]]") == 0) return {};
  }
  return file.string() + ": no scene, it has no [[volume]]; choose another file";
}

namespace {

constexpr ImGuiWindowFlags kTouched =
    (kStillPanel & ~(ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoScrollbar)) |
    ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoNavInputs;
constexpr ImGuiSliderFlags kDragOnly = ImGuiSliderFlags_NoInput | ImGuiSliderFlags_AlwaysClamp;

void choose_gradient(ViewSettings& settings) {
  auto chosen = static_cast<std::size_t>(settings.gradient);
  if (ImGui::BeginCombo("gradient", kGradientNames[chosen].data())) {
    for (std::size_t i = 0; i < kGradientNames.size(); ++i) {
      if (ImGui::Selectable(kGradientNames[i].data(), i == chosen)) chosen = i;
    }
    ImGui::EndCombo();
  }
  settings.gradient = static_cast<GradientFilter>(chosen);
}

/// Draws a tool that lies from `corner` to the right, its tip first, within a box of `size`.
void draw_side(const Silhouette& side, ImVec2 corner, ImVec2 size) {
  if (side.empty()) return;
  double out = 0.0;
  for (const auto& [y, left, right] : side) out = std::max({out, -left, right});
  const double low = side.front()[0], length = side.back()[0] - low;
  const double scale =
      std::min(static_cast<double>(size.x) / length, static_cast<double>(size.y) / (2.0 * out));
  const auto at = [&](double y, double x) {
    return ImVec2(corner.x + static_cast<float>((y - low) * scale),
                  corner.y + 0.5F * size.y - static_cast<float>(x * scale));
  };
  ImDrawList& to = *ImGui::GetWindowDrawList();
  const ImDrawListFlags smooth = to.Flags;
  to.Flags &= ~ImDrawListFlags_AntiAliasedFill;  // else the rows show their seams
  for (std::size_t i = 1; i < side.size(); ++i) {
    const auto& [y0, left0, right0] = side[i - 1];
    const auto& [y1, left1, right1] = side[i];
    to.AddQuadFilled(at(y0, right0), at(y1, right1), at(y1, left1), at(y0, left0),
                     ImGui::GetColorU32(kValueColour));
  }
  to.Flags = smooth;
}

constexpr float kSideWide = 38.0F, kSideHigh = 13.0F;

/// Of a list that holds the longest of the names, or as much of it as `most` allows.
float width_of_tools(const std::vector<ToolChoice>& tools, float least, float most) {
  float words = 0.0F;
  for (const ToolChoice& tool : tools) {
    words = std::max(words, ImGui::CalcTextSize(tool.text.c_str()).x);
  }
  const float around = ImGui::GetFrameHeight() + 2.0F * ImGui::GetStyle().FramePadding.x;
  return std::clamp(words + around, least, std::max(least, most));
}

/// The picture of the one in the hand stands in place of a label.
void choose_tool(ViewControls& controls, float least_wide, float most_wide) {
  if (controls.tools.size() < 2 || controls.tool >= controls.tools.size()) return;
  const std::size_t held = controls.tool;
  const ImVec2 picture{kSideWide * unit_px(), kSideHigh * unit_px()};
  const float wide = width_of_tools(controls.tools, least_wide, most_wide);
  const float words = wide - ImGui::GetFrameHeight() - 2.0F * ImGui::GetStyle().FramePadding.x;
  ImGui::SetNextItemWidth(wide);
  if (ImGui::BeginCombo("##tool", shortened(controls.tools[held].text, words).c_str())) {
    for (std::size_t i = 0; i < controls.tools.size(); ++i) {
      ImGui::PushID(static_cast<int>(i));  // two may have one name
      if (ImGui::Selectable("##this", i == held, 0, {0.0F, picture.y})) controls.tool = i;
      const ImVec2 corner = ImGui::GetItemRectMin();
      draw_side(controls.tools[i].side, corner, picture);
      ImGui::SameLine(picture.x + 2.0F * ImGui::GetStyle().ItemSpacing.x);
      ImGui::TextUnformatted(controls.tools[i].text.c_str());
      ImGui::PopID();
    }
    ImGui::EndCombo();
  }
  ImGui::SameLine(0.0F, ImGui::GetStyle().ItemInnerSpacing.x);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  draw_side(controls.tools[held].side,
            {corner.x, corner.y + 0.5F * (ImGui::GetFrameHeight() - picture.y)}, picture);
  ImGui::Dummy({picture.x, ImGui::GetFrameHeight()});
}

/// One for each volume.
void choose_renderers(ViewControls& controls) {
  const std::size_t count = controls.volumes.size();
  const std::vector<std::string> now = renderer_of_each(controls.settings.renderer, count);
  for (std::size_t v = 0; v < count; ++v) {
    ImGui::PushID(static_cast<int>(v));
    const std::string label =
        count == 1 ? "renderer" : shortened(controls.volumes[v], kWidestName * unit_px());
    if (ImGui::BeginCombo(label.c_str(), now[v].c_str())) {
      for (const std::string_view kind : renderer_kinds()) {
        const std::string name(kind);
        if (!ImGui::Selectable(name.c_str(), now[v] == name)) continue;
        controls.settings.renderer = with_renderer(controls.settings.renderer, count, v, name);
      }
      ImGui::EndCombo();
    }
    ImGui::PopID();
  }
}

void choose_opacities(ViewControls& controls) {
  ViewSettings& settings = controls.settings;
  ImGui::TextColored(kLabelColour, "opacity of 1/8 mm");
  ImGui::SameLine();
  controls.write = ImGui::SmallButton("write");
  for (const auto& [material, opacity] : controls.opacities) {
    auto value = static_cast<float>(opacity);
    const std::string label = shortened(material, kWidestName * unit_px()) + "##" + material;
    if (ImGui::SliderFloat(label.c_str(), &value, 0.0F, 1.0F, "%.3f",
                           kDragOnly | ImGuiSliderFlags_Logarithmic)) {
      settings.opacities[material] = rounded_to(0.001, static_cast<double>(value));
    }
  }
}

void choose_clip_plane(ViewSettings& settings) {
  ImGui::Checkbox("clip", &settings.clip.on);
  if (settings.clip.on) {
    constexpr std::array kAxes{"x", "y", "z", "free"};
    const int choices = settings.clip.axis == ClipPlane::kFree ? 4 : 3;  // x turns it freely
    for (int axis = 0; axis < choices; ++axis) {
      ImGui::SameLine();
      ImGui::RadioButton(kAxes[static_cast<std::size_t>(axis)], &settings.clip.axis, axis);
    }
    auto at = static_cast<float>(settings.clip.at);
    if (ImGui::SliderFloat("plane", &at, 0.0F, 1.0F, "%.2f", kDragOnly)) settings.clip.at = at;
  }
}

}  // namespace

float SettingsPanel::least_high() {
  return 48.0F * unit_px();
}

float SettingsPanel::draw(ViewControls& controls, PictureSize size, float most_high,
                          float most_area) {
  constexpr float kPlain = 130.0F, kOfWidth = 0.27F;  // lists; that of the tools in a wide picture
  const float gap = panel_gap();
  const float wide = wide_ > 0.0F ? wide_ : 215.0F * unit_px();
  const float high = std::max(std::min(most_area / wide, most_high), least_high());
  ImGui::SetNextWindowPos(ImVec2(gap, static_cast<float>(size.height) - gap), 0,
                          ImVec2(0.0F, 1.0F));
  ImGui::SetNextWindowSizeConstraints(ImVec2(0.0F, 0.0F),
                                      ImVec2(std::numeric_limits<float>::max(), high));
  ImGui::Begin("look", nullptr, kTouched);
  ViewSettings& settings = controls.settings;
  ImGui::PushItemWidth(kPlain * unit_px());
  choose_tool(controls, kPlain * unit_px(), kOfWidth * static_cast<float>(size.width));
  choose_renderers(controls);
  choose_gradient(settings);
  if (controls.has_iso) choose_iso(controls);
  if (!controls.opacities.empty()) choose_opacities(controls);
  choose_clip_plane(settings);
  ImGui::Checkbox("stereo", &settings.stereo.on);
  ImGui::SameLine();
  ImGui::Checkbox("voxel tool", &settings.voxel_tool);
  ImGui::PopItemWidth();
  wide_ = ImGui::GetWindowWidth();
  const float end_x = ImGui::GetWindowPos().x + wide_;
  ImGui::End();
  return end_x;
}

void SettingsPanel::choose_iso(ViewControls& controls) {
  ViewSettings& settings = controls.settings;
  float iso = dragged_iso_.value_or(static_cast<float>(settings.iso.value_or(controls.own_iso)));
  if (ImGui::SliderFloat("iso", &iso, 0.02F, 0.98F, "%.2f", kDragOnly)) dragged_iso_ = iso;
  if (ImGui::IsItemDeactivated() && dragged_iso_) {
    settings.iso = *dragged_iso_;
    dragged_iso_.reset();
  }
}

double rounded_to(double step, double value) {
  return std::round(value / step) * step;
}

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
