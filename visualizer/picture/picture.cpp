// SPDX-License-Identifier: Apache-2.0

#include "visualizer/picture/picture.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <span>
#include <string>

#include <glm/gtc/matrix_access.hpp>

#include "shared/segment/tick_table.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/sound/spindle_sound.hpp"

namespace kerf {

namespace {

constexpr double kStaleMs = 100.0;  // a servo that is alive beats each tick
constexpr double kToolRoom = 1.5;   // sizes around the volumes in which the tool is never clipped

glm::dvec3 vec3(const float (&v)[3]) {
  return {v[0], v[1], v[2]};
}

void clear(const RenderTarget& target) {
  target.bind();
  constexpr float kBlack[4] = {0.0F, 0.0F, 0.0F, 1.0F};
  glClearNamedFramebufferfv(target.framebuffer(), GL_COLOR, 0, kBlack);
}

/// Of length 1, towards what a plane cuts off.
glm::dvec3 direction_of(const ClipPlane& plane) {
  if (plane.axis == ClipPlane::kFree) {
    return {plane.towards[0], plane.towards[1], plane.towards[2]};
  }
  glm::dvec3 axis(0.0);
  axis[plane.axis] = 1.0;
  return axis;
}

/// The name of a code of docs/log.md.
std::string name_of(std::span<const TickCode> codes, std::uint32_t value) {
  const auto found =
      std::ranges::find_if(codes, [&](const TickCode& code) { return code.value == value; });
  return found == codes.end() ? std::to_string(value) : std::string(found->name);
}

/// What stands between the hand and its force, and what to do; empty: nothing.
std::string state_words(const TickRecord& record) {
  // Phases and faults as docs/log.md lists them.
  constexpr std::uint16_t kCalibrating = 1, kArmed = 2, kFault = 5;
  constexpr std::uint32_t kWrongDock = 7;
  switch (record.phase) {
    case kCalibrating:
      return "the motors are off: park the device at rest, so that it is calibrated";
    case kArmed:
      return "parked: take the device in hand";
    case kFault:
      if (record.fault == kWrongDock) {
        return "fault wrong_dock: parked elsewhere than when the run began; rest the device there, "
               "or "
               "start again if it lies there";
      }
      return "fault " + name_of(kTickFaults, record.fault) +
             ": the motors are off; park the device at rest (a hand led by the pointer: k)";
    default:
      return {};
  }
}

/// What a record has to say to who holds its arm.
struct Advice {
  std::string text;  ///< empty: nothing
  bool alarm = false;
};

Advice advice_of(const TickRecord& record) {
  if ((record.flags & kFlagRefused) != 0) {
    return {"no free place for this tool here, so it feels nothing: lead it into air", true};
  }
  if (const std::string words = state_words(record); !words.empty()) {
    return {words, record.fault != 0};
  }
  if ((record.flags & kFlagForbidden) != 0) return {"pressed on what may not be cut", true};
  if ((record.flags & kFlagShaft) != 0) return {"the shaft touches: it cuts nothing", false};
  return {};
}

/// Of both arms what is urgent, and of two equals the first arm's.
Advice advice_of(const std::optional<TickRecord>& first, const std::optional<TickRecord>& second) {
  const Advice of_first = first ? advice_of(*first) : Advice{};
  const Advice of_second = second ? advice_of(*second) : Advice{};
  const bool takes_second = of_second.alarm ? !of_first.alarm : of_first.text.empty();
  if (of_second.text.empty() || !takes_second) return of_first;
  return {"second arm: " + of_second.text, of_second.alarm};
}

std::string tool_name(const TickRecord& record, const SceneView& scene) {
  return record.active_tool < scene.tools.size() ? scene.tools[record.active_tool].name : "";
}

SecondArmFigures second_arm_figures(const TickRecord& record, const SceneView& scene) {
  const bool has_fault = record.fault != 0;
  return {
      .force_n = glm::length(vec3(record.commanded_force_n)),
      .tool = tool_name(record, scene),
      .state = has_fault ? name_of(kTickFaults, record.fault) : name_of(kTickPhases, record.phase),
      .alarm = has_fault};
}

}  // namespace

Picture::Picture(const Session& session, const ViewSettings& settings, double aspect)
    : scene_(session.scene()), settings_(settings), painter_(painter_for(session, settings)) {
  const std::vector<glm::dvec3> corners = scene_.corners();
  low_mm_ = high_mm_ = corners.front();
  for (const glm::dvec3& corner : corners) {
    low_mm_ = glm::min(low_mm_, corner);
    high_mm_ = glm::max(high_mm_, corner);
  }
  reset_camera(aspect);
}

SceneView Picture::shown_scene() const {
  return scene_in(settings_);
}

SceneView Picture::scene_in(const ViewSettings& settings) const {
  SceneView scene = scene_;
  scene.gradient = settings.gradient;
  scene.voxel_tool = settings.voxel_tool;
  for (VolumeView& volume : scene.volumes) {
    if (settings.iso) volume.iso = static_cast<Density>(std::lround(*settings.iso * kDensityMax));
  }
  if (settings.colour_blind) take_okabe_ito(scene.materials);
  for (MaterialView& material : scene.materials) {
    const auto chosen = settings.opacities.find(material.name);
    if (chosen != settings.opacities.end()) material.opacity = chosen->second;
  }
  return scene;
}

std::unique_ptr<ScenePainter> Picture::painter_for(const Session& session,
                                                   const ViewSettings& settings) {
  auto painter =
      std::make_unique<ScenePainter>(settings.renderer, scene_in(settings), session.contents());
  if (settings.clip.on) painter->set_cut_open(true, session.contents());
  for (const VolumeView& volume : scene_.volumes) bricks_uploaded_ += volume.bricks.count();
  return painter;
}

void Picture::set_view(const Session& session, const ViewSettings& settings) {
  if (settings == settings_) return;
  if (settings.renderer != settings_.renderer || settings.iso != settings_.iso ||
      settings.gradient != settings_.gradient || settings.voxel_tool != settings_.voxel_tool ||
      settings.colour_blind != settings_.colour_blind) {
    painter_ = painter_for(session, settings);
  } else {
    if (settings.clip.on != settings_.clip.on)
      painter_->set_cut_open(settings.clip.on, session.contents());
    if (settings.opacities != settings_.opacities) {
      painter_->set_opacities(scene_in(settings), session.contents());
    }
  }
  settings_ = settings;
  redraw_all();
}

ViewControls Picture::controls() const {
  ViewControls controls{.settings = settings_, .own_iso = scene_.main_volume().iso / kDensityMax};
  for (const VolumeView& volume : scene_.volumes) controls.volumes.push_back(volume.name);
  controls.has_iso = painter_->any(ScenePainter::Layer::opaque);
  if (painter_->any(ScenePainter::Layer::translucent)) {
    controls.opacities = opacities();
  }
  return controls;
}

std::vector<ScoreRow> Picture::score(const Session& session) const {
  const std::vector<MaterialView> materials = scene_in(settings_).materials;
  const std::vector<double> removed = session.removed_by_material_mm3();
  std::vector<ScoreRow> rows;
  const auto srgb = [](double linear) {
    constexpr double kGamma = 2.2;
    return static_cast<float>(std::pow(std::clamp(linear, 0.0, 1.0), 1.0 / kGamma));
  };
  for (std::size_t m = 1; m < materials.size(); ++m) {
    const glm::dvec3& colour = materials[m].colour;
    rows.push_back({materials[m].name, srgb(colour.r), srgb(colour.g), srgb(colour.b), removed[m]});
  }
  return rows;
}

Opacities Picture::opacities() const {
  Opacities opacities;
  const std::vector<MaterialView> materials = scene_in(settings_).materials;
  for (std::size_t m = 1; m < materials.size(); ++m) {
    opacities[materials[m].name] = materials[m].opacity.value_or(default_opacity(materials, m));
  }
  return opacities;
}

glm::dvec2 Picture::reach_along(const glm::dvec3& towards) const {
  const glm::dvec3 middle = 0.5 * (low_mm_ + high_mm_);
  const double half = glm::dot(glm::abs(towards), 0.5 * (high_mm_ - low_mm_));
  return glm::dot(towards, middle) + glm::dvec2(-half, half);
}

ClipPlane Picture::facing_plane(const std::optional<glm::dvec3>& point_mm) const {
  const View view = camera_.view(1.0, camera_.radius_mm());
  const glm::dvec3 towards = glm::normalize(glm::dvec3(glm::row(view.eye_from_world, 2)));
  const glm::dvec2 reach = reach_along(towards);
  ClipPlane plane{.on = true,
                  .axis = ClipPlane::kFree,
                  .at = 0.5,
                  .towards = {towards.x, towards.y, towards.z}};
  if (point_mm) {
    const double along = glm::dot(towards, *point_mm);
    plane.at = std::clamp((along - reach.x) / (reach.y - reach.x), 0.0, 1.0);
  }
  return plane;
}

ClipPlane Picture::moved(const ClipPlane& plane, double mm) const {
  const glm::dvec2 reach = reach_along(direction_of(plane));
  ClipPlane moved = plane;
  moved.at = std::clamp(plane.at + mm / (reach.y - reach.x), 0.0, 1.0);
  return moved;
}

glm::dvec4 Picture::clip_plane() const {
  const ClipPlane& clip = settings_.clip;
  if (!clip.on) return View{}.clip_plane;
  const glm::dvec3 towards = direction_of(clip);
  const glm::dvec2 reach = reach_along(towards);
  return {-towards, glm::mix(reach.x, reach.y, clip.at)};
}

void Picture::reset_camera(double aspect) {
  camera_.frame(scene_.corners(), settings_.stereo.on ? 0.5 * aspect : aspect);
  if (settings_.camera) camera_.look(*settings_.camera);
}

void Picture::update(const Session& session) {
  for (std::size_t v = 0; v < scene_.volumes.size(); ++v) {
    painter_->update(v, session.snapshot(v));
    bricks_uploaded_ += session.snapshot(v).changed.size();
  }
}

View Picture::middle_view(PictureSize size) const {
  const double reach_mm = camera_.radius_mm() + kToolRoom * scene_.main_volume().radius_mm();
  View view = camera_.view(static_cast<double>(eye_size(size).width) / size.height, reach_mm);
  view.clip_plane = clip_plane();
  return view;
}

std::vector<View> Picture::views(PictureSize size) const {
  const View view = middle_view(size);
  if (eye_size(size) == size) return {view};
  const Stereo& stereo = settings_.stereo;
  const double convergence_mm = stereo.convergence_mm.value_or(camera_.distance_mm());
  const double eyes_mm = stereo.eyes_mm.value_or(kEyesPerConvergence * convergence_mm);
  const auto both = eye_views(view, {eyes_mm, convergence_mm});
  return {both.begin(), both.end()};
}

PictureSize Picture::eye_size(PictureSize size) const noexcept {
  const bool fits_two = settings_.stereo.on && size.width > 1;
  return {fits_two ? size.width / 2 : size.width, size.height};
}

Redrawn Picture::draw(const Session& session, const OverlayFigures& figures,
                      const RenderTarget& target) {
  const PictureSize size = eye_size(target.size());
  const std::vector<View> views = this->views(target.size());
  const Hands hands = hands_of(session);
  if (eyes_.size() != views.size() || eyes_.front().seen().size() != size) {
    eyes_.clear();
    for (std::size_t eye = 0; eye < views.size(); ++eye) eyes_.emplace_back(size);
    shown_in_ = 0;
  }
  std::vector<PictureLayers::Redraw> redraws;
  const double most_each = most_pixels_ / static_cast<double>(views.size());
  for (std::size_t eye = 0; eye < views.size(); ++eye) {
    redraws.push_back(eyes_[eye].redraw(views[eye], hands, *painter_, most_each));
  }
  painter_->forget_changes();
  const OverlayFigures panel = figures.rounded();
  const bool same_target = target.framebuffer() == shown_in_ && target.size() == shown_size_;
  const bool rests =
      std::all_of(redraws.begin(), redraws.end(), [](const auto& one) { return one.empty(); });
  if (rests && same_target && panel == shown_figures_) return {};

  if (!same_target) clear(target);  // an odd column belongs to neither eye
  const std::vector<PixelRect> panels = overlay_.prepare(panel, size);
  // They let the picture shine through.
  std::vector<PixelRect> under_panels = panels;
  std::copy_if(
      shown_panels_.begin(), shown_panels_.end(), std::back_inserter(under_panels),
      [&](const PixelRect& before) { return std::ranges::find(panels, before) == panels.end(); });
  std::vector<PixelRect> parts;
  double redrawn = 0.0, pixels = 0.0;
  for (std::size_t eye = 0; eye < eyes_.size(); ++eye) {
    std::vector<PixelRect> others = eyes_[eye].draw(redraws[eye], *painter_, passes_);
    const RenderTarget& seen = eyes_[eye].seen();
    if (same_target) {
      others.insert(others.end(), under_panels.begin(), under_panels.end());
    } else {
      others = {seen.all()};
    }
    const int right = static_cast<int>(eye) * size.width;
    for (const PixelRect& part : clipped(others, seen.all())) {
      target.copy_colour(seen, part, right);
      parts.push_back({part.x0 + right, part.y0, part.x1 + right, part.y1});
    }
    const bool translucent = painter_->any(ScenePainter::Layer::translucent);
    const std::vector<PixelRect>& volumes =
        translucent ? redraws[eye].composite : redraws[eye].opaque;
    for (const PixelRect& part : volumes) redrawn += part.area();
    for (const PixelRect& part : redraws[eye].coarse) redrawn += part.area();
    pixels += redraws[eye].pixels;
  }
  overlay_.draw(target, static_cast<int>(eyes_.size()));
  glDisable(GL_SCISSOR_TEST);
  shown_figures_ = panel;
  shown_in_ = target.framebuffer();
  shown_size_ = target.size();
  shown_panels_ = panels;
  if (!same_target) parts = {target.all()};
  return {true, redrawn / (static_cast<double>(eyes_.size()) * size.width * size.height), pixels,
          std::move(parts)};
}

bool Picture::is_late() const {
  return std::any_of(eyes_.begin(), eyes_.end(),
                     [](const PictureLayers& eye) { return eye.is_late(); });
}

void Picture::draw_panels(const RenderTarget& target) {
  static_cast<void>(overlay_.prepare(shown_figures_, eye_size(target.size())));
  overlay_.draw(target, static_cast<int>(eyes_.size()));
  glDisable(GL_SCISSOR_TEST);
}

bool Picture::handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size) {
  const PictureSize eye = eye_size(size);
  Pointer within = pointer;
  if (within.x >= eye.width) within.x -= eye.width;
  return overlay_.handle(within, figures, eye);
}

Redrawn draw_measured(Picture& picture, Session& session, const OverlayFigures& figures,
                      const RenderTarget& target, FrameReport& report) {
  const Stopwatch watch;
  const auto removal = session.take_oldest_removal();
  const Redrawn redrawn = picture.draw(session, figures, target);
  if (!redrawn.any) {
    ++report.rest_frames;
    return redrawn;
  }
  glFinish();
  throw_if_context_is_lost();
  report.wall_ms.push_back(watch.wall_ms());
  report.cpu_ms.push_back(watch.cpu_ms());
  report.redrawn.push_back(redrawn.fraction);
  if (removal && redrawn.fraction > 0.0) {
    const auto since = std::chrono::steady_clock::now() - *removal;
    report.latency_ms.push_back(std::chrono::duration<double, std::milli>(since).count());
  }
  return redrawn;
}

OverlayFigures overlay_figures(const Session& session) {
  OverlayFigures figures;
  if (const auto& record = session.latest()) {
    figures.force_n = glm::length(vec3(record->commanded_force_n));
    figures.tool = tool_name(*record, session.scene());
    if (session.scene().has_spindle) {
      const ToolSound turning = tool_sound(*record);
      figures.spindle = {turning.turns_per_s * 60.0 / 1000.0, turning.load};
    }
  }
  if (session.second()) {
    figures.second = second_arm_figures(*session.second(), session.scene());
  }
  const std::vector<double> removed = session.removed_by_material_mm3();
  figures.removed_mm3 = std::accumulate(removed.begin(), removed.end(), 0.0);
  figures.score_is_partial = session.cut_before();
  for (const MaterialView& material : session.scene().materials) {
    if (!material.forbidden) continue;
    figures.forbidden += (figures.forbidden.empty() ? "" : ", ") + material.name;
  }
  figures.forbidden_ms = session.forbidden_ms();
  if (const auto& pulp = session.pulp()) {
    figures.pulp_rise_c = pulp->rise_c();
    figures.pulp_harmed = pulp->harm_s() > 0;
  }
  figures.tick_rate_hz = session.tick_rate_hz();
  figures.data_age_ms = session.data_age_ms();
  if (session.ended()) {
    figures.banner = session.ended_cleanly() ? "the controller has ended: this is the final state"
                                             : "the controller is gone: this is its last state";
    figures.alarm = !session.ended_cleanly();
    figures.data_age_ms.reset();
  } else if (figures.data_age_ms && *figures.data_age_ms > kStaleMs && session.is_held()) {
    figures.banner = "paused";  // a replay: a controller on hold goes on sending
    figures.data_age_ms.reset();
  } else if (figures.data_age_ms && *figures.data_age_ms > kStaleMs) {
    figures.banner = "stale: no news from the servo";
    figures.alarm = true;
  } else {
    const Advice advice = advice_of(session.latest(), session.second());
    figures.banner = advice.text;
    figures.alarm = advice.alarm;
  }
  return figures;
}

}  // namespace kerf
