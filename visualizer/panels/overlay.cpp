// SPDX-License-Identifier: Apache-2.0

#include "visualizer/panels/overlay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include "shared/text/text.hpp"
#include "visualizer/panels/figure_panels.hpp"
#include "visualizer/panels/panel_font.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

void ForcePlot::add(const TickRecord& record) {
  if (!points_.empty() && record.start_ns <= points_.back().time_ns) return;
  const float(&force)[3] = record.commanded_force_n;
  points_.push_back(
      {record.start_ns, std::hypot(force[0], force[1], force[2]), record.penetration_mm});
  constexpr auto kSpanNs = static_cast<std::uint64_t>(kSpanS * 1e9);
  const auto first = std::find_if(points_.begin(), points_.end(), [&](const Point& point) {
    return record.start_ns - point.time_ns <= kSpanNs;
  });
  points_.erase(points_.begin(), first);
}

OverlayFigures OverlayFigures::rounded() const {
  OverlayFigures shown = *this;
  shown.force_n = rounded_to(0.01, force_n);
  if (second) shown.second->force_n = rounded_to(0.01, second->force_n);
  shown.removed_mm3 = rounded_to(0.01, removed_mm3);
  if (pulp_rise_c) shown.pulp_rise_c = rounded_to(0.1, *pulp_rise_c);
  if (tick_rate_hz) shown.tick_rate_hz = rounded_to(1.0, *tick_rate_hz);
  if (frame_rate_hz) shown.frame_rate_hz = rounded_to(1.0, *frame_rate_hz);
  if (spindle) {
    shown.spindle = {rounded_to(1.0, spindle->krpm), rounded_to(0.01, spindle->load)};
  }
  if (hand) {
    for (double HandMark::*length : {&HandMark::goal_x, &HandMark::goal_y, &HandMark::tool_x,
                                     &HandMark::tool_y, &HandMark::radius}) {
      (*shown.hand).*length = rounded_to(0.5, (*hand).*length);
    }
    shown.hand->deeper_mm = rounded_to(0.1, hand->deeper_mm);
  }
  for (ScoreRow& material : shown.score) {
    material.removed_mm3 = rounded_to(0.01, material.removed_mm3);
  }
  if (data_age_ms) shown.data_age_ms = rounded_to(0.1, *data_age_ms);
  if (picture_age_ms) shown.picture_age_ms = rounded_to(10.0, *picture_age_ms);
  return shown;
}

namespace {

constexpr double kQuarter = 0.25, kPlainWidth = 640.0, kPlainHeight = 480.0;

/// Letters for what is asked, but no larger than where a plain picture would have as much room.
float letters_for(double scale, PictureSize size) {
  const double room = std::min(size.width / kPlainWidth, size.height / kPlainHeight);
  const double taken = std::clamp(scale, 1.0, std::max(1.0, room));
  return std::floor(kPlainLetters * static_cast<float>(taken));
}

ImGuiStyle style_for(float unit) {
  ImGuiStyle style;
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = 5.0F;
  style.FrameRounding = 3.0F;
  style.WindowBorderSize = 0.0F;
  style.WindowPadding = ImVec2(11.0F, 9.0F);
  style.CellPadding = ImVec2(4.0F, 1.5F);
  style.ScrollbarSize = 10.0F;
  style.Colors[ImGuiCol_WindowBg] = ImVec4(0.04F, 0.05F, 0.06F, 0.72F);
  style.Colors[ImGuiCol_FrameBg] = ImVec4(1.0F, 1.0F, 1.0F, 0.12F);
  // Dark enough for the digits that stand on it.
  style.Colors[ImGuiCol_SliderGrab] = ImVec4(0.12F, 0.34F, 0.50F, 1.0F);
  style.Colors[ImGuiCol_SliderGrabActive] = ImVec4(0.16F, 0.42F, 0.60F, 1.0F);
  if (unit != 1.0F) style.ScaleAllSizes(unit);
  return style;
}

using Box = std::array<float, 4>;

/// Of all that was laid out last, in the order of drawing.
std::vector<Box> laid_out() {
  std::vector<Box> boxes;
  const ImDrawData& panels = *ImGui::GetDrawData();
  for (int i = 0; i < panels.CmdListsCount; ++i) {
    for (const ImDrawCmd& command : panels.CmdLists[i]->CmdBuffer) {
      const ImVec4& clip = command.ClipRect;
      boxes.push_back({clip.x, clip.y, clip.z, clip.w});
    }
  }
  return boxes;
}

}  // namespace

int slice_side(PictureSize size, double scale) {
  constexpr double kThird = 1.0 / 3.0, kLeast = 24.0;
  const ImGuiStyle plain = style_for(1.0F);
  const double unit = static_cast<double>(letters_for(scale, size) / kPlainLetters);
  const double gap = 12.0 * unit;
  const double label = (static_cast<double>(kPlainLetters) + 2.0 * plain.ItemSpacing.y) * unit;
  const double wide = kThird * size.width - gap - 2.0 * plain.WindowPadding.x * unit;
  const double high = kThird * (size.height - 2.0 * (gap + plain.WindowPadding.y * unit)) - label;
  const double side = std::floor(std::min(wide, high));
  return side < kLeast ? 0 : static_cast<int>(side);
}

Overlay::Overlay() {
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
  if (!ImGui_ImplOpenGL3_Init("#version 330 core")) {
    ImGui::DestroyContext();
    throw VisualizerError("overlay: Dear ImGui finds no OpenGL functions; install libgl1");
  }
}

Overlay::~Overlay() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext();
}

void Overlay::begin_frame(const OverlayFigures& figures, PictureSize size) {
  const float letters = letters_for(figures.scale, size);
  if (letters != letters_) {
    letters_ = letters;
    load_panel_font(*ImGui::GetIO().Fonts, letters);
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
    ImGui::GetStyle() = style_for(letters / kPlainLetters);
  }
  ImGui_ImplOpenGL3_NewFrame();
}

bool Overlay::handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size) {
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = ImVec2(static_cast<float>(pointer.x), static_cast<float>(pointer.y));
  io.MouseDown[0] = pointer.down;
  io.MouseWheel = static_cast<float>(pointer.wheel);
  begin_frame(figures, size);
  lay_out(figures, size);
  if (figures.controls && io.WantCaptureMouse) figures.controls->over = pointer;
  return io.WantCaptureMouse;
}

void Overlay::lay_out(OverlayFigures& figures, PictureSize size) {
  const ImVec2 all{static_cast<float>(size.width), static_cast<float>(size.height)};
  ImGui::GetIO().DisplaySize = all;
  ImGui::NewFrame();
  const double plain = kPlainWidth * kPlainHeight * static_cast<double>(unit_px() * unit_px());
  const double picture = static_cast<double>(all.x) * static_cast<double>(all.y);
  auto room = static_cast<float>(kQuarter * std::max(plain, picture));
  float controls_x = 0.0F;
  if (figures.open) {
    draw_open_panel(*figures.open, all, room);
  } else if (figures.help > 0) {
    help_pages_ = draw_key_help(all, figures.leads_hand, figures.help, room);
  } else if (!figures.hidden) {
    const ImVec2 taken = draw_figures(figures);
    room -= taken.x * taken.y;
    // In a small picture what would lie over the figures is left out.
    const float right = all.x - taken.x - 3.0F * panel_gap();
    const float below = all.y - taken.y - 3.0F * panel_gap();
    if (figures.slices && width_of_slices(*figures.slices) <= right) {
      show(*figures.slices);
      const auto texture = static_cast<std::intptr_t>(slices_->id());
      // NOLINTNEXTLINE(performance-no-int-to-ptr): ImGui carries the texture's number as a pointer
      draw_slices(*figures.slices, reinterpret_cast<ImTextureID>(texture), all);
    }
    if (figures.controls && below >= SettingsPanel::least_high()) {
      controls_x = settings_panel_.draw(*figures.controls, size, below, room);
    }
  }
  if (figures.hand) draw_hand_mark(*figures.hand, figures.force_n / figures.full_force_n);
  if (!figures.banner.empty()) draw_banner(figures.banner, figures.alarm, all, controls_x);
  ImGui::Render();
}

void Overlay::show(const SliceViews& slices) {
  if (uploaded_ == slices) return;
  if (!uploaded_ || uploaded_->side != slices.side) {
    slices_ = GlTexture2D::create();
    glTextureStorage2D(slices_->id(), 1, GL_RGB8, slices.side, 3 * slices.side);
    read_nearest(slices_->id());
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(slices_->id(), 0, 0, 0, slices.side, 3 * slices.side, GL_RGB,
                      GL_UNSIGNED_BYTE, slices.rgb.data());
  uploaded_ = slices;
}

namespace {

/// The pixels that a command may touch: its clip rectangle is that of the picture for most.
PixelRect drawn_by(const ImDrawList& panel, const ImDrawCmd& command, int height) {
  const ImVec4& clip = command.ClipRect;  // from the upper left corner, as all places are
  float left = clip.z, right = clip.x, top = clip.w, bottom = clip.y;
  for (unsigned i = 0; i < command.ElemCount; ++i) {
    const unsigned index = panel.IdxBuffer[static_cast<int>(command.IdxOffset + i)];
    const ImVec2& at = panel.VtxBuffer[static_cast<int>(command.VtxOffset + index)].pos;
    left = std::min(left, at.x);
    right = std::max(right, at.x);
    top = std::min(top, at.y);
    bottom = std::max(bottom, at.y);
  }
  const auto lowest = static_cast<int>(std::ceil(std::min(bottom, clip.w)));
  const auto highest = static_cast<int>(std::floor(std::max(top, clip.y)));
  return {static_cast<int>(std::floor(std::max(left, clip.x))), height - lowest,
          static_cast<int>(std::ceil(std::min(right, clip.z))), height - highest};
}

}  // namespace

std::vector<PixelRect> Overlay::prepare(const OverlayFigures& figures, PictureSize size) {
  begin_frame(figures, size);
  OverlayFigures shown = figures;
  // ImGui learns the size of what a panel holds by laying it out, and the room of a panel is what
  // those before it leave: so it is done until two passes give the same.
  constexpr int kMostPasses = 8;
  std::vector<Box> before{{}};  // unlike any
  for (int pass = 0; pass < kMostPasses; ++pass) {
    lay_out(shown, size);
    std::vector<Box> now = laid_out();
    if (now == before) break;
    before = std::move(now);
  }
  std::vector<PixelRect> all;
  const ImDrawData& panels = *ImGui::GetDrawData();
  for (int i = 0; i < panels.CmdListsCount; ++i) {
    ImDrawList& panel = *panels.CmdLists[i];
    PixelRect bounds;
    for (ImDrawCmd& command : panel.CmdBuffer) {
      // The other eye's picture begins there.
      command.ClipRect.z = std::min(command.ClipRect.z, static_cast<float>(size.width));
      bounds = bounds.united(drawn_by(panel, command, size.height));
    }
    if (!bounds.empty()) all.push_back(bounds);
  }
  return all;
}

void Overlay::draw(const RenderTarget& target, int eyes) {
  target.bind();
  glUseProgram(0);  // ImGui puts back what was in use, and that may have gone
  ImDrawData& panels = *ImGui::GetDrawData();
  panels.DisplaySize.x = static_cast<float>(target.size().width);
  const int eye_width = target.size().width / eyes;
  for (int eye = 0; eye < eyes; ++eye) {
    panels.DisplayPos.x = static_cast<float>(-eye * eye_width);
    ImGui_ImplOpenGL3_RenderDrawData(&panels);
  }
}

void Notices::say(const Notice& notice, Clock::time_point now) {
  if (notice.problem) {
    std::fprintf(stderr, "kerf-visualizer: %s\n", escaped(notice.text).c_str());
  } else {
    std::printf("%s\n", escaped(notice.text).c_str());
    std::fflush(stdout);  // a pipe would keep it until the end
  }
  last_ = notice;
  shown_until_ = now + kShownFor;
}

void Notices::show(OverlayFigures& figures, Clock::time_point now) const {
  if (now >= shown_until_ || (figures.hidden && !last_.problem)) return;
  figures.banner = last_.text;
  figures.alarm = last_.problem;
}

void ShownRates::show(OverlayFigures& figures, Clock::time_point now) {
  constexpr auto kRateSpan = std::chrono::seconds(1);
  frames_.push_back(now);
  while (now - frames_.front() > kRateSpan) frames_.pop_front();
  if (!shown_since_ || now - *shown_since_ >= kHold) {
    shown_since_ = now;
    tick_rate_hz_ = figures.tick_rate_hz;
    frame_rate_hz_ = frame_rate_hz();
    data_age_ms_ = figures.data_age_ms;
    picture_age_ms_ = figures.picture_age_ms;
    filmed_frames_ = figures.filmed_frames;
  }
  figures.tick_rate_hz = tick_rate_hz_;
  figures.frame_rate_hz = frame_rate_hz_;
  figures.data_age_ms = data_age_ms_;
  figures.picture_age_ms = picture_age_ms_;
  figures.filmed_frames = filmed_frames_;
}

std::optional<double> ShownRates::frame_rate_hz() const {
  if (frames_.size() < 2) return std::nullopt;
  const std::chrono::duration<double> span = frames_.back() - frames_.front();
  return static_cast<double>(frames_.size() - 1) / span.count();
}

}  // namespace kerf
