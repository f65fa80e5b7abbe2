// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <thread>
#include <utility>

#include "shared/posix/new_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "visualizer/app/film.hpp"
#include "visualizer/app/force_plot.hpp"
#include "visualizer/app/picture.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/app/window_figures.hpp"
#include "visualizer/app/window_keys.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/render/renderer_choice.hpp"
#include "visualizer/surface/mesh_file.hpp"
#include "visualizer/view/frame_report.hpp"

namespace kerf {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kFrame = std::chrono::microseconds(16'667);  // no faster than screens refresh
constexpr auto kReattachPause = std::chrono::milliseconds(500);

void move_camera(OrbitCamera& camera, const WindowInput& input) {
  camera.orbit(input.turn_right, input.turn_up);
  camera.pan(input.move_right, input.move_up);
  if (input.wheel != 0.0) camera.zoom(input.wheel);
}

/// The session in a window and its picture. A controller that is started again under the same name
/// takes the place of the one that ended; the look stays.
class FollowedSession {
 public:
  FollowedSession(const VisualizerOptions& options, Session first, double aspect)
      : options_(options),
        session_(std::move(first)),
        picture_(std::in_place, session_, options.look, aspect) {}

  [[nodiscard]] Session& session() noexcept { return session_; }
  [[nodiscard]] Picture& picture() noexcept { return *picture_; }
  /// Of all sessions so far.
  [[nodiscard]] std::uint64_t bricks_uploaded() const {
    return earlier_bricks_ + picture_->bricks_uploaded();
  }

  void update(double aspect) {
    if (session_.ended() && Clock::now() >= next_attach_) attach_again(aspect);
    session_.poll();
    picture_->update(session_);
  }

 private:
  void attach_again(double aspect) {
    next_attach_ = Clock::now() + kReattachPause;
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

  const VisualizerOptions& options_;
  Session session_;
  std::optional<Picture> picture_;
  std::uint64_t earlier_bricks_ = 0;
  Clock::time_point next_attach_{};
};

/// The window from its first frame to its last: input, the session, panels, picture, film.
class WindowRun {
 public:
  WindowRun(const VisualizerOptions& options, Session first)
      : options_(options),
        record_from_start_(options.record.has_value()),
        report_{.renderer = options.look.renderer, .attach_ms = first.attach_ms()},
        window_(options.size, Window::Visibility::shown),
        aspect_(static_cast<double>(options.size.width) / options.size.height),
        followed_(options, std::move(first), aspect_) {
    window_.set_title("kerf: " + options.name);
    report_.gl_renderer = query_gl_driver().renderer;
    report_.context = to_string(window_.kind());
    if (options.attached) write_new_file(*options.attached, "");
  }

  [[nodiscard]] double age_ms() const { return since_attached_.wall_ms(); }

  /// One frame; false when the user wants to leave.
  bool step() {
    const auto begin = Clock::now();
    const PictureSize size = window_.size();
    const bool visible = size.width > 0 && size.height > 0;
    if (visible) aspect_ = static_cast<double>(size.width) / size.height;
    const WindowInput input = window_.poll();
    if (keys_.apply(input, session(), picture(), aspect_, notices_)) return false;
    followed_.update(aspect_);
    if (const auto& newest = session().latest()) plot_.add(*newest);
    if (std::exchange(keys_.mesh, false)) notices_.say(export_mesh(options_, session()), begin);
    if (keys_.screenshot) notices_.clear();  // what was said of the one before
    if (visible) draw(size, input, begin);
    return true;
  }

  /// Completes and writes the report; returns the exit code.
  [[nodiscard]] int end() {
    report_.renderer = picture().look().renderer;
    report_.bricks_uploaded = followed_.bricks_uploaded();
    report_.clean_end = session().ended_cleanly();
    if (options_.report) report_.write(*options_.report);
    return exit_code(session(), video_is_cut_);
  }

 private:
  [[nodiscard]] Session& session() noexcept { return followed_.session(); }
  [[nodiscard]] Picture& picture() noexcept { return followed_.picture(); }

  [[nodiscard]] OverlayFigures figures_at(Clock::time_point now) {
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

  void draw(PictureSize size, const WindowInput& input, Clock::time_point begin) {
    if (!target_ || target_->size() != size) target_.emplace(size);
    if (std::exchange(record_from_start_, false)) {
      film_.emplace(*options_.record, size, options_.video_hz);
    }
    if (std::exchange(keys_.film, false)) notices_.say(toggle_film(options_, size, film_), begin);
    OverlayFigures figures = figures_at(begin);
    if (!picture().handle(input.pointer, figures, size)) move_camera(picture().camera(), input);
    change_look(picture(), session(), figures.controls->look, notices_);
    if (std::exchange(keys_.write, false) || std::exchange(figures.controls->write, false)) {
      notices_.say(write_opacities(options_, picture()), begin);
    }
    const Redrawn redrawn = draw_measured(picture(), session(), figures, *target_, report_);
    if (report_.wall_ms.size() == 1) report_.late_join_ms = age_ms();
    if (std::exchange(keys_.screenshot, false)) {
      notices_.say(take_screenshot(options_, *target_), begin);
    }
    if (redrawn.any || input.exposed) window_.present(*target_);
    if (const auto problem = add_frame(film_, *target_, session().servo_s())) {
      notices_.say({*problem, true}, begin);
      video_is_cut_ = true;
    }
    report_.width = size.width;
    report_.height = size.height;
  }

  const VisualizerOptions& options_;
  const Stopwatch since_attached_;
  bool record_from_start_, video_is_cut_ = false;
  FrameReport report_;
  Window window_;
  double aspect_;
  FollowedSession followed_;
  std::optional<RenderTarget> target_;
  ShownRates rates_;
  WindowKeys keys_;
  Notices notices_;
  ForcePlot plot_;
  std::optional<Film> film_;
};

}  // namespace

int run_window(const VisualizerOptions& options) {
  place_process(options.cpus);
  if (options.mesh) check_export(*options.mesh);
  if (options.report) check_new_file(*options.report);
  WindowRun run(options, attach(options));
  constexpr double kMsPerS = 1e3;
  const double end_ms = options.seconds.value_or(std::numeric_limits<double>::infinity()) * kMsPerS;
  auto next_frame = Clock::now();
  while (!stop_requested() && run.age_ms() < end_ms && run.step()) {
    next_frame = std::max(next_frame + kFrame, Clock::now());  // a late wake does not add up
    std::this_thread::sleep_until(next_frame);
  }
  return run.end();
}

}  // namespace kerf
