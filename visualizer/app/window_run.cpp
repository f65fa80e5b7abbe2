// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/window_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "shared/posix/atomic_file.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

namespace {

constexpr auto kReattachPause = std::chrono::milliseconds(500);

constexpr double kFarthestPullMm = 60;   // of the hand: farther off it parks, and pulls nothing
constexpr double kLongestFrameS = 0.05;  // one that took longer was none of the user's
constexpr double kStaleS = 0.25;         // after which the hand presses no more (GuidedHand)

void move_camera(OrbitCamera& camera, const WindowInput& input) {
  camera.orbit(input.turn_right + input.drag_right, input.turn_up + input.drag_up);
  camera.pan(input.move_right, input.move_up);
  if (const double steps = input.wheel + input.zoom; steps != 0.0) camera.zoom(steps);
}

/// Left button and wheel are the hand's; what it works at stays where it is in the picture.
void move_camera_around(OrbitCamera& camera, const glm::dvec3& goal_mm, const WindowInput& input) {
  if (input.turn_right != 0.0 || input.turn_up != 0.0) {
    camera.orbit_about(goal_mm, input.turn_right, input.turn_up);
  }
  camera.pan(input.move_right, input.move_up);
  if (input.zoom != 0.0) camera.zoom_about(goal_mm, input.zoom);
}

}  // namespace

FollowedSession::FollowedSession(const VisualizerOptions& options, Session first, double aspect)
    : options_(options),
      session_(std::move(first)),
      picture_(std::in_place, session_, options.settings, aspect) {}

void FollowedSession::update(double aspect, Clock::time_point now) {
  if (session_.ended() && now >= next_attach_) attach_again(aspect, now);
  session_.poll();
  picture_->update(session_);
}

void FollowedSession::attach_again(double aspect, Clock::time_point now) {
  next_attach_ = now + kReattachPause;
  const std::size_t volumes = session_.scene().volumes.size();
  try {
    session_ = Session(options_.name);
  } catch (const SegmentError&) {
    return;  // not there yet
  }
  earlier_bricks_ += picture_->bricks_uploaded();
  ViewSettings settings = picture_->settings();
  if (session_.scene().volumes.size() != volumes) {
    settings.renderer = renderer_of_each(settings.renderer, volumes).front();
  }
  picture_.reset();  // before the new one: one overlay at a time
  picture_.emplace(session_, settings, aspect);
  ++runs_;
}

void FramePace::learn(double pixels, PictureSize size, double ms) noexcept {
  constexpr double kFewest = 1.0 / 64.0;  // of a picture: of fewer the rest of a frame costs most
  constexpr double kForget = 0.3;         // air is cheap, and what comes next may not be
  if (pixels < kFewest * size.width * size.height) return;
  if (!std::exchange(begun_, true)) return;  // it compiled shaders
  const double now = ms / pixels;
  const double before = std::isfinite(ms_per_pixel_) ? ms_per_pixel_ : now;
  ms_per_pixel_ = std::max(now, before + kForget * (now - before));
}

WindowRun::WindowRun(const VisualizerOptions& options, Session first, const GlContext& context,
                     const Stopwatch& since_attached)
    : options_(options),
      since_attached_(since_attached),
      record_from_start_(options.record.has_value()),
      report_{.renderer = options.settings.renderer,
              .gl_renderer = query_gl_driver().renderer,
              .context = to_string(context.kind()),
              .attach_ms = first.attach_ms()},
      aspect_(static_cast<double>(options.size.width) / options.size.height),
      followed_(options, std::move(first), aspect_),
      shared_view_(options) {
  keys_.hidden = !options.panels;
  if (options.hand_socket) {
    hand_link_.emplace(*options.hand_socket);
    space_mouse_.emplace();
  }
  if (options.attached) write_new_file(*options.attached, "");
}

WindowRun::Frame WindowRun::step(const WindowInput& input, PictureSize size,
                                 Clock::time_point now) {
  const bool visible = size.width > 0 && size.height > 0;
  if (visible) aspect_ = static_cast<double>(size.width) / size.height;
  density_ = input.density;
  keys_.help_pages = picture().help_pages();
  if (keys_.apply(input, session(), picture(), aspect_, notices_, now) || chosen_) {
    return {.quit = true};
  }
  if (std::exchange(keys_.open, false)) toggle_list(now);
  followed_.update(aspect_, now);
  if (const auto& newest = session().latest()) plot_.add(*newest);
  if (std::exchange(keys_.mesh, false)) notices_.say(export_mesh(options_, session()), now);
  if (hand_link_) {
    if (const auto news = hand_link_->step(now)) notices_.say(*news, now);
  }
  foretell_end(now);
  if (keys_.screenshot) notices_.clear();  // what was said of the one before
  if (!visible) return {};
  Redrawn redrawn = draw(size, input, now);
  if (input.exposed) redrawn.parts = {target_->all()};
  return {.drawn = redrawn.any || input.exposed ? &*target_ : nullptr,
          .parts = std::move(redrawn.parts),
          .leads_hand = pointer_leads_};
}

int WindowRun::end() {
  report_.renderer = picture().settings().renderer;
  report_.bricks_uploaded = followed_.bricks_uploaded();
  report_.clean_end = session().ended_cleanly();
  if (options_.report) report_.write(*options_.report);
  return exit_code(session(), video_is_cut_);
}

OverlayFigures WindowRun::figures_at(PictureSize size, Clock::time_point now) {
  OverlayFigures figures = overlay_figures(session());
  if (film_) figures.filmed_frames = film_->file().frames();
  const Clock::time_point complete = complete_since_.value_or(now);
  figures.picture_age_ms = std::chrono::duration<double, std::milli>(now - complete).count();
  rates_.show(figures, now);
  figures.help = keys_.help;
  figures.leads_hand = hand_link_.has_value();
  figures.hidden = keys_.hidden;
  notices_.show(figures, now);
  if (keys_.plot) figures.plot = plot_.points();
  figures.score = picture().score(session());
  if (keys_.slices) figures.slices = slices_at_tip(picture().eye_size(size));
  figures.open = open_;
  figures.scale = options_.panel_scale.value_or(density_);
  figures.controls = picture().controls();
  for (const ToolView& tool : session().scene().tools) {
    std::array<char, 24> size{};
    std::snprintf(size.data(), size.size(), "%.1f mm ", 2.0 * tool.radius_mm);
    figures.controls->tools.push_back({size.data() + tool.name, silhouette_of(tool)});
  }
  if (const auto& newest = session().latest()) figures.controls->tool = newest->active_tool;
  return figures;
}

void WindowRun::toggle_list(Clock::time_point now) {
  if (!options_.choice) {
    notices_.say({"open: no demo waits for a choice; start ./kerf demo", true}, now);
  } else if (open_) {
    open_.reset();
  } else {
    open_ = OpenPanel{list_folder(options_.open_in)};
  }
}

void WindowRun::choose(const OpenPanel& panel, Clock::time_point now) {
  const FolderList& list = panel.list;
  const FolderList::Entry& entry = list.entries[*panel.chosen];
  const std::filesystem::path path =
      entry.name == ".." ? list.folder.parent_path() : list.folder / entry.name;
  if (entry.is_folder) {
    open_ = OpenPanel{list_folder(path)};
    return;
  }
  if (open_->list.note = why_not_open(path); !open_->list.note.empty()) return;
  try {
    write_new_file(*options_.choice, path.string() + "\n");
    chosen_ = true;
  } catch (const FileError& problem) {
    notices_.say({problem.what(), true}, now);
  }
}

std::optional<SliceViews> WindowRun::slices_at_tip(PictureSize size) {
  const auto hand = session().latest() ? hand_of(*session().latest()) : std::nullopt;
  const int side = slice_side(size, options_.panel_scale.value_or(density_));
  if (!hand || side == 0) return std::nullopt;
  bool changed = !slices_ || slices_->side != side || sliced_at_mm_ != hand->tip_mm ||
                 sliced_with_ != picture().settings();
  for (std::size_t v = 0; v < session().scene().volumes.size(); ++v) {
    changed = changed || !session().snapshot(v).changed.empty();
  }
  if (changed) {
    slices_ = slice_views(picture().shown_scene(), session().contents(), hand->tip_mm, side);
    sliced_at_mm_ = hand->tip_mm;
    sliced_with_ = picture().settings();
  }
  return slices_;
}

void WindowRun::follow(const WindowInput& input, OverlayFigures& figures, PictureSize size,
                       Clock::time_point now) {
  // A button that began to press in the picture is none for the panels: else they let the pointer
  // pass, and the hand would go on behind them.
  Pointer pointer = input.pointer;
  press_is_hands_ = press_is_hands_ && pointer.down;
  pointer.down = pointer.down && !press_is_hands_;
  const bool over_panel = picture().handle(pointer, figures, size);
  press_is_hands_ = press_is_hands_ || (hand_link_ && input.pointer.down && !over_panel);
  if (!over_panel) {
    const auto centre_mm = hand_centre_mm();
    centre_mm ? move_camera_around(picture().camera(), *centre_mm, input)
              : move_camera(picture().camera(), input);
  }
  if (hand_link_) lead_hand(input, over_panel, figures, size, now);
  pointer_leads_ = figures.hand.has_value() && !over_panel;
}

std::optional<glm::dvec3> WindowRun::hand_centre_mm() {
  if (const auto goal_mm = hand_.goal_mm()) return goal_mm;
  if (!hand_link_ || !hand_link_->leads() || !session().latest()) return std::nullopt;
  const auto held = hand_of(*session().latest());
  return held ? std::optional(held->tip_mm) : std::nullopt;
}

void WindowRun::lead_hand(const WindowInput& input, bool over_panel, OverlayFigures& figures,
                          PictureSize size, Clock::time_point now) {
  const double frame_s = std::chrono::duration<double>(now - last_led_).count();
  last_led_ = now;
  if (std::exchange(keys_.come, false)) hand_.come();
  const bool hung = frame_s > kStaleS && hand_.presses();  // not: it began while the window hung
  if (std::exchange(keys_.end_press, false) || hung) hand_.end_press();
  WindowInput seen = input;
  if (const auto news = space_mouse_->step(seen.held)) notices_.say({*news, true}, now);
  if (!input.visible) seen.held = {};  // no pad presses what its user cannot see
  const auto held = session().latest() ? hand_of(*session().latest()) : std::nullopt;
  const bool resized = std::exchange(led_in_, size) != size;
  if (!held || !hand_link_->leads()) {
    hand_.come();  // what the pointer does meanwhile is not followed
    return;
  }
  const SceneView& scene = session().scene();
  const View view = picture().middle_view(size);
  const PictureSize eye = picture().eye_size(size);
  check_pedal(now);
  const bool in_second = seen.pointer.x >= eye.width;
  if (in_second) seen.pointer.x -= eye.width;
  const bool crossed = std::exchange(in_second_eye_, in_second) != in_second;
  const bool in_stereo = picture().settings().stereo.on;
  const bool switched = std::exchange(in_stereo_, in_stereo) != in_stereo;
  // A jump is no motion; nor is another way of seeing. What lay under the pointer lies elsewhere in
  // a window of another size.
  if (resized || (crossed && !switched)) hand_.come();
  hand_.step(seen, over_panel, view, eye, held->tip_mm, scene.device,
             std::min(frame_s, kLongestFrameS));
  time_the_tool(input, held->tip_mm, now);
  const bool leads = hand_.leads();
  if (!std::exchange(led_, leads) && !leads) return;  // one more target lets go of the pedal
  HandTarget target = hand_.target(scene.device);
  target.park = std::exchange(keys_.park, false);
  hand_link_->send(target);
  if (!leads) return;
  const SeenPoint goal = seen_at(view, eye, *hand_.goal_mm());
  const SeenPoint tool = seen_at(view, eye, held->tip_mm);
  const double away_mm = glm::length(*hand_.goal_mm() - held->tip_mm) / scene.device.scale;
  if (goal.depth_mm <= 0.0 || tool.depth_mm <= 0.0 || away_mm > kFarthestPullMm) return;
  const double radius_mm =
      held->tool < scene.tools.size() ? scene.tools[held->tool].radius_mm : 0.0;
  figures.hand = {goal.pixel.x,
                  goal.pixel.y,
                  tool.pixel.x,
                  tool.pixel.y,
                  radius_mm * eye.height / (2.0 * view.tan_half_height * goal.depth_mm),
                  goal.depth_mm - tool.depth_mm};
}

void WindowRun::foretell_end(Clock::time_point now) {
  constexpr std::array kBeforeS{10.0, 120.0};
  const auto ticks = session().ticks_since_armed();
  if (!options_.ends_after_s || !ticks || session().ended()) return;
  constexpr double kNsPerS = 1e9;
  const double run_s = static_cast<double>(*ticks) * session().tick_ns() / kNsPerS;
  const double left_s = *options_.ends_after_s - run_s;
  const auto* const before = std::ranges::find_if(kBeforeS, [&](double s) { return left_s <= s; });
  if (before == kBeforeS.end() || told_left_s_ <= *before) return;
  told_left_s_ = *before;
  notices_.say({"this run ends in " + std::to_string(std::lround(std::max(left_s, 0.0))) +
                " s: it was given " + std::to_string(std::lround(*options_.ends_after_s)) +
                " s, by --seconds or by default; give --seconds N for more"},
               now);
}

void WindowRun::check_pedal(Clock::time_point now) {
  const std::uint32_t flags = session().latest()->flags;
  if ((flags & kFlagStarted) == 0 || std::exchange(pedal_is_checked_, true)) return;
  if ((flags & kFlagPedal) != 0) return;
  notices_.say(
      {"this tool cuts whenever it presses, without a pedal: give kerf-controller --pedal, "
       "or the scene no cut.pedal = \"always\"",
       true},
      now);
}

void WindowRun::time_the_tool(const WindowInput& input, const glm::dvec3& tool_mm,
                              Clock::time_point now) {
  constexpr double kRestsMm = 0.005, kMovedMm = 0.02;
  const bool moved = input.free_right != 0.0 || input.free_up != 0.0;
  const bool rested = glm::length(tool_mm - last_tool_mm_) < kRestsMm;
  last_tool_mm_ = tool_mm;
  if (moved && rested && !followed_since_) followed_since_ = {now, tool_mm};
  if (!followed_since_ || glm::length(tool_mm - followed_since_->second) < kMovedMm) return;
  tool_follows_ = true;
}

Redrawn WindowRun::draw(PictureSize size, const WindowInput& input, Clock::time_point now) {
  if (!target_ || target_->size() != size) target_.emplace(size);
  if (std::exchange(record_from_start_, false)) {
    begin_recording(options_, size, film_);
  }
  if (std::exchange(keys_.film, false)) notices_.say(toggle_film(options_, size, film_), now);
  OverlayFigures figures = figures_at(size, now);
  const std::size_t held = figures.controls->tool;
  follow(input, figures, size, now);
  if (figures.open && figures.open->chosen) choose(*figures.open, now);
  if (figures.controls->tool != held) {
    take_tool(figures.controls->tool, session(), notices_, now);
    figures.controls->tool = held;  // until the controller has changed it
  }
  if (input.keys.end() != std::find(input.keys.begin(), input.keys.end(), 'r')) {
    shared_view_.follow_again();
  }
  if (const auto news = shared_view_.step(picture().camera(), followed_.runs())) {
    notices_.say(*news, now);
  }
  const std::string drawn_by = picture().settings().renderer;
  change_view(picture(), session(), figures.controls->settings, notices_, now);
  if (picture().settings().renderer != drawn_by) pace_ = {};
  if (std::exchange(keys_.write, false) || std::exchange(figures.controls->write, false)) {
    notices_.say(write_opacities(options_, picture()), now);
  }
  if (std::exchange(keys_.note, false)) notices_.say(write_view(options_, picture()), now);
  const bool is_kept = film_ || keys_.screenshot;  // a file holds no coarse part
  picture().set_most_pixels(is_kept ? std::numeric_limits<double>::infinity()
                                    : fixed_pixels_.value_or(pace_.most_pixels()));
  const Redrawn redrawn = draw_measured(picture(), session(), figures, *target_, report_);
  if (!picture().is_late()) complete_since_ = now;
  if (redrawn.any) pace_.learn(redrawn.pixels, size, report_.wall_ms.back());
  if (std::exchange(tool_follows_, false)) {
    const std::chrono::duration<double, std::milli> late = Clock::now() - followed_since_->first;
    report_.pointer_ms.push_back(late.count());
    followed_since_.reset();
  }
  if (report_.wall_ms.size() == 1) report_.late_join_ms = age_ms();
  if (std::exchange(keys_.screenshot, false)) {
    notices_.say(take_screenshot(options_, *target_), now);
  }
  if (const auto problem = add_frame(film_, *target_, session().servo_s())) {
    notices_.say({*problem, true}, now);
    video_is_cut_ = true;
  }
  report_.width = size.width;
  report_.height = size.height;
  return redrawn;
}

}  // namespace kerf
