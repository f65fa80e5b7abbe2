// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "shared/posix/new_file.hpp"
#include "visualizer/app/cpu_placement.hpp"
#include "visualizer/app/export_surface.hpp"
#include "visualizer/app/force_plot.hpp"
#include "visualizer/app/notices.hpp"
#include "visualizer/app/picture.hpp"
#include "visualizer/app/recording.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/app/shown_rates.hpp"
#include "visualizer/app/user_files.hpp"
#include "visualizer/error.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/render/renderer_choice.hpp"
#include "visualizer/view/frame_report.hpp"
#include "visualizer/view/stop_signal.hpp"
#include "visualizer/view/transfer_file.hpp"

namespace kerf {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kFrame = std::chrono::microseconds(16'667);  // no faster than screens refresh
constexpr auto kReattachPause = std::chrono::milliseconds(500);

/// A renderer that cannot show these volumes leaves the one that can.
void change_look(Picture& picture, const Session& session, const Look& look, Notices& notices) {
  try {
    picture.set_look(session, look);
  } catch (const VisualizerError& problem) {
    notices.say({problem.what(), true}, Clock::now());
  }
}

void move_camera(OrbitCamera& camera, const WindowInput& input) {
  camera.orbit(input.turn_right, input.turn_up);
  camera.pan(input.move_right, input.move_up);
  if (input.wheel != 0.0) camera.zoom(input.wheel);
}

/// What keys change.
struct Keys {
  bool help = false;
  bool hidden = false;  ///< the panels
  bool plot = false;
  bool screenshot = false;
  bool mesh = false;
  bool write = false;
  bool record = false;  ///< begin or end
  std::size_t one = 0;  ///< volume that v is for, counted from 1; 0: all

  /// True when the user wants to leave.
  bool apply(const WindowInput& input, Session& session, Picture& picture, double aspect,
             Notices& notices) {
    bool quit = input.close;
    Look look = picture.look();
    const std::vector<VolumeView>& volumes = session.scene().volumes;
    if (one > volumes.size()) one = 0;  // another controller may show fewer
    for (const char key : input.keys) {
      if (key == 'q') quit = true;
      if (key == 'r') picture.reset_camera(aspect);
      if (key == 's') screenshot = true;
      if (key == 'e') mesh = true;
      if (key == 'w') write = true;
      if (key == 'm') record = !record;
      if (key == 'h') {  // panels, with the keys, none
        const bool shown = !hidden;
        hidden = shown && help;
        help = shown && !help;
      }
      if (key == 'p') plot = !plot;
      if (key == 'v') {
        look.renderer = one > 0 ? next_renderer(look.renderer, volumes.size(), one - 1)
                                : next_renderer(look.renderer);
      }
      if (key == 'b') {
        one = (one + 1) % (volumes.size() + 1);
        notices.say({"v: " + (one > 0 ? volumes[one - 1].name : "all volumes")}, Clock::now());
      }
      if (key == 'c') look.clip.on = !look.clip.on;
      if (key == 't') look.stereo.on = !look.stereo.on;
      const int tool = key - '1';
      if (tool >= 0 && tool < static_cast<int>(session.scene().tools.size())) {
        session.select_tool(static_cast<std::uint32_t>(tool));
      }
    }
    change_look(picture, session, look, notices);
    return quit;
  }
};

/// The session on the screen and its picture; a controller that was restarted under the same name
/// takes the place of the one that ended.
class Followed {
 public:
  Followed(const VisualizerOptions& options, Session first, double aspect)
      : options_(options),
        session_(std::move(first)),
        picture_(std::in_place, session_, first_look(options), aspect) {}

  [[nodiscard]] Session& session() noexcept { return session_; }
  [[nodiscard]] Picture& picture() noexcept { return *picture_; }
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

}  // namespace

int run_window(const VisualizerOptions& options) {
  place_process(options.cpus);
  if (options.mesh) check_export(*options.mesh);
  if (options.report) check_new_file(*options.report);
  Session first = Session::attach(options.name, std::chrono::duration<double>(options.wait_s));
  if (options.transfer) {
    check_materials(options.opacities, first.scene(), options.transfer->string());
  }
  FrameReport report{.renderer = options.renderer};
  report.attach_ms = first.attach_ms();
  const Stopwatch since_attached;
  Window window(options.size, Window::Visibility::shown);
  window.set_title("kerf: " + options.name);
  const GlDriver driver = query_gl_driver();
  report.gl_renderer = driver.renderer;
  report.context = to_string(window.kind());

  double aspect = static_cast<double>(options.size.width) / options.size.height;
  Followed followed(options, std::move(first), aspect);
  if (options.attached) write_new_file(*options.attached, "");
  std::optional<RenderTarget> target;
  ShownRates rates;
  Keys keys;
  Notices notices;
  ForcePlot plot;
  std::optional<Recording> recording;
  bool video_is_cut = false;
  auto next_frame = Clock::now();
  bool record_from_start = options.record.has_value();
  constexpr double kMsPerS = 1e3;
  const double end_ms = options.seconds.value_or(std::numeric_limits<double>::infinity()) * kMsPerS;
  while (!stop_requested() && since_attached.wall_ms() < end_ms) {
    const auto begin = Clock::now();
    const PictureSize size = window.size();
    const bool visible = size.width > 0 && size.height > 0;
    if (visible) aspect = static_cast<double>(size.width) / size.height;
    const WindowInput input = window.poll();
    if (keys.apply(input, followed.session(), followed.picture(), aspect, notices)) break;
    followed.update(aspect);
    if (const auto& newest = followed.session().latest()) plot.add(*newest);
    if (std::exchange(keys.mesh, false)) {
      notices.say(export_mesh(options, followed.session()), begin);
    }
    if (keys.screenshot) notices.clear();  // what was said of the one before
    if (visible) {
      if (!target || target->size() != size) target.emplace(size);
      if (std::exchange(record_from_start, false)) {
        recording.emplace(*options.record, size, options.video_hz);
      }
      if (std::exchange(keys.record, false)) {
        notices.say(toggle_recording(options, size, recording), begin);
      }
      OverlayFigures figures = overlay_figures(followed.session());
      if (recording) figures.filmed_frames = recording->file().frames();
      rates.show(figures, begin);
      figures.help = keys.help;
      figures.hidden = keys.hidden;
      notices.show(figures, begin);
      if (keys.plot) figures.plot = plot.points();
      figures.controls = followed.picture().controls();
      if (!followed.picture().handle(input.pointer, figures, size)) {
        move_camera(followed.picture().camera(), input);
      }
      change_look(followed.picture(), followed.session(), figures.controls->look, notices);
      if (std::exchange(keys.write, false) || std::exchange(figures.controls->write, false)) {
        notices.say(write_opacities(options, followed.picture()), begin);
      }
      const Redrawn redrawn =
          draw_measured(followed.picture(), followed.session(), figures, *target, report);
      if (report.wall_ms.size() == 1) report.late_join_ms = since_attached.wall_ms();
      if (std::exchange(keys.screenshot, false)) {
        notices.say(take_screenshot(options, *target), begin);
      }
      if (redrawn.any || input.exposed) window.present(*target);
      if (const auto problem = film(recording, *target, followed.session().servo_s())) {
        notices.say({*problem, true}, begin);
        video_is_cut = true;
      }
      report.width = size.width;
      report.height = size.height;
    }
    next_frame = std::max(next_frame + kFrame, Clock::now());  // a late wake does not add up
    std::this_thread::sleep_until(next_frame);
  }
  report.renderer = followed.picture().look().renderer;
  report.bricks_uploaded = followed.bricks_uploaded();
  report.clean_end = followed.session().ended_cleanly();
  if (options.report) report.write(*options.report);
  return exit_code(followed.session(), video_is_cut);
}

}  // namespace kerf
