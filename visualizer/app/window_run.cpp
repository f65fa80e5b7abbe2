// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/window_run.hpp"

#include <utility>

#include "shared/posix/new_file.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/render/renderer_choice.hpp"

namespace kerf {

namespace {

constexpr auto kReattachPause = std::chrono::milliseconds(500);

void move_camera(OrbitCamera& camera, const WindowInput& input) {
  camera.orbit(input.turn_right, input.turn_up);
  camera.pan(input.move_right, input.move_up);
  if (input.wheel != 0.0) camera.zoom(input.wheel);
}

}  // namespace

FollowedSession::FollowedSession(const VisualizerOptions& options, Session first, double aspect)
    : options_(options),
      session_(std::move(first)),
      picture_(std::in_place, session_, options.look, aspect) {}

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
  Look look = picture_->look();
  if (session_.scene().volumes.size() != volumes) {
    look.renderer = renderer_of_each(look.renderer, volumes).front();
  }
  picture_.reset();  // before the new one: one overlay at a time
  picture_.emplace(session_, look, aspect);
}

WindowRun::WindowRun(const VisualizerOptions& options, Session first, const GlContext& context,
                     const Stopwatch& since_attached)
    : options_(options),
      since_attached_(since_attached),
      record_from_start_(options.record.has_value()),
      report_{.renderer = options.look.renderer,
              .gl_renderer = query_gl_driver().renderer,
              .context = to_string(context.kind()),
              .attach_ms = first.attach_ms()},
      aspect_(static_cast<double>(options.size.width) / options.size.height),
      followed_(options, std::move(first), aspect_) {
  if (options.attached) write_new_file(*options.attached, "");
}

WindowRun::Frame WindowRun::step(const WindowInput& input, PictureSize size,
                                 Clock::time_point now) {
  const bool visible = size.width > 0 && size.height > 0;
  if (visible) aspect_ = static_cast<double>(size.width) / size.height;
  if (keys_.apply(input, session(), picture(), aspect_, notices_, now)) return {.quit = true};
  followed_.update(aspect_, now);
  if (const auto& newest = session().latest()) plot_.add(*newest);
  if (std::exchange(keys_.mesh, false)) notices_.say(export_mesh(options_, session()), now);
  if (keys_.screenshot) notices_.clear();  // what was said of the one before
  if (!visible) return {};
  const Redrawn redrawn = draw(size, input, now);
  return {.drawn = redrawn.any || input.exposed ? &*target_ : nullptr};
}

int WindowRun::end() {
  report_.renderer = picture().look().renderer;
  report_.bricks_uploaded = followed_.bricks_uploaded();
  report_.clean_end = session().ended_cleanly();
  if (options_.report) report_.write(*options_.report);
  return exit_code(session(), video_is_cut_);
}

OverlayFigures WindowRun::figures_at(Clock::time_point now) {
  OverlayFigures figures = overlay_figures(session());
  if (film_) figures.filmed_frames = film_->file().frames();
  rates_.show(figures, now);
  figures.help = keys_.help;
  figures.hidden = keys_.hidden;
  notices_.show(figures, now);
  if (keys_.plot) figures.plot = plot_.points();
  figures.controls = picture().controls();
  return figures;
}

Redrawn WindowRun::draw(PictureSize size, const WindowInput& input, Clock::time_point now) {
  if (!target_ || target_->size() != size) target_.emplace(size);
  if (std::exchange(record_from_start_, false)) {
    film_.emplace(*options_.record, size, options_.video_hz);
  }
  if (std::exchange(keys_.film, false)) notices_.say(toggle_film(options_, size, film_), now);
  OverlayFigures figures = figures_at(now);
  if (!picture().handle(input.pointer, figures, size)) move_camera(picture().camera(), input);
  change_look(picture(), session(), figures.controls->look, notices_, now);
  if (std::exchange(keys_.write, false) || std::exchange(figures.controls->write, false)) {
    notices_.say(write_opacities(options_, picture()), now);
  }
  const Redrawn redrawn = draw_measured(picture(), session(), figures, *target_, report_);
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
