// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <thread>

#include "shared/numeric/percentile.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/words.hpp"
#include "visualizer/app/contact_sheet.hpp"
#include "visualizer/app/film.hpp"
#include "visualizer/app/frame_schedule.hpp"
#include "visualizer/app/picture.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/app/tick_lead.hpp"
#include "visualizer/error.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/surface/mesh_file.hpp"
#include "visualizer/view/file_out.hpp"
#include "visualizer/view/frame_report.hpp"

namespace kerf {

namespace {

constexpr auto kIdle = std::chrono::milliseconds(2);  // two ticks: a picture is at most that late
constexpr auto kShort = std::chrono::microseconds(100);  // where the next tick is due
constexpr double kMsPerS = 1e3;

std::filesystem::path frame_file(const std::filesystem::path& folder, std::uint32_t number) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "frame-%04u.png", number);
  return folder / name.data();
}

/// Draws the session as it is and measures that.
class FrameTaker {
 public:
  FrameTaker(Picture& picture, const VisualizerOptions& options, FrameReport& report)
      : picture_(picture),
        target_(options.size),
        report_(report),
        scale_(options.panel_scale.value_or(1.0)) {}

  void draw(Session& session) {
    figures_ = overlay_figures(session);
    figures_.score = picture_.score(session);
    figures_.scale = scale_;
    draw_measured(picture_, session, figures_, target_, report_);
  }
  [[nodiscard]] const RenderTarget& target() const noexcept { return target_; }
  /// What was drawn last, as it looks at rest: a still shows nothing coarsely.
  void write(const Session& session, const std::filesystem::path& file) {
    static_cast<void>(picture_.draw(session, figures_, target_));
    write_png(file, target_.size(), target_.read_rgb());
  }

 private:
  Picture& picture_;
  RenderTarget target_;
  FrameReport& report_;
  double scale_;
  OverlayFigures figures_;
};

/// The tick that the next picture or frame shows: a controller in lock-step is let go so far.
Tick next_tick(const Session& session, const FrameSchedule& schedule,
               const std::optional<Film>& film) {
  constexpr Tick kUntilArmed = 20;  // fewer than are between two pictures
  const Tick now = session.latest() ? session.latest()->tick : 0;
  const auto ticks = session.ticks_since_armed();
  if (!ticks) return now + kUntilArmed;
  Tick next = std::numeric_limits<Tick>::max();
  if (!schedule.complete()) next = now - *ticks + schedule.next_ticks();
  if (film) {
    const double due_ticks = film->due_in_s(session.servo_s()) * 1e9 / session.tick_ns();
    next = std::min(next, now + static_cast<Tick>(std::max(1.0, std::ceil(due_ticks))));
  }
  return next;
}

void tell(const VisualizerOptions& options, const FrameSchedule& schedule,
          const std::optional<Film>& film, const FrameReport& report) {
  if (schedule.taken() > 0) {
    std::printf("%u pictures in %s, ", schedule.taken(), escaped(options.out.string()).c_str());
  }
  if (film) {
    const VideoFile& video = film->file();
    std::printf("%ju frames in %s, ", std::uintmax_t{video.frames()},
                escaped(video.path()).c_str());
  }
  std::vector<double> cpu_ms = report.cpu_ms;
  std::printf("%.1f cpu ms each (%s)\n", percentile(cpu_ms, 0.5), report.gl_renderer.c_str());
}

/// A frame of a film begins when the tick that it waits for is out, not up to a pause later: its
/// delay counts as latency.
std::chrono::duration<double> pause_before_frame(const Film& film, const Session& session) {
  const std::chrono::duration<double> due(film.due_in_s(session.servo_s()) -
                                          session.record_age_s());
  return std::clamp<std::chrono::duration<double>>(due, kShort, kIdle);
}

}  // namespace

int run_headless(const VisualizerOptions& options) {
  place_process(options.cpus);
  if (options.frames > 0) check_new_folder(options.out);
  check_files(options);
  if (options.lead && !std::filesystem::is_fifo(*options.lead)) {
    throw VisualizerError("--lead " + *options.lead + ": no FIFO; make one with mkfifo");
  }
  const auto context = make_headless_context();
  const GlDriver driver = query_gl_driver();
  FrameReport report{.renderer = options.look.renderer,
                     .gl_renderer = driver.renderer,
                     .context = to_string(context->kind()),
                     .width = options.size.width,
                     .height = options.size.height};

  Session session = attach(options);
  report.attach_ms = session.attach_ms();
  const Stopwatch since_attached;
  const double aspect = static_cast<double>(options.size.width) / options.size.height;
  Picture picture(session, options.look, aspect);
  FrameTaker taker(picture, options, report);
  taker.draw(session);  // not kept: the driver compiles shaders at their first use
  if (options.attached) write_new_file(*options.attached, "");
  report.late_join_ms = since_attached.wall_ms();
  report.cpu_ms.clear();
  report.wall_ms.clear();
  report.redrawn.clear();
  report.latency_ms.clear();

  std::optional<Film> film;
  if (options.record) film.emplace(*options.record, options.size, options.video_hz);
  FrameSchedule schedule(options.frames, options.every_ticks.value_or(ticks_between(
                                             options.frames, options.seconds, session.tick_ns())));
  std::optional<TickLead> lead;
  if (options.lead) lead.emplace(*options.lead);
  if (options.frames > 0) make_folder(options.out);
  bool over = false;
  while (!over && (film || !schedule.complete())) {
    over = session.ended() || stop_requested() ||
           (options.seconds && since_attached.wall_ms() >= *options.seconds * kMsPerS);
    session.poll();
    picture.update(session);
    const auto ticks = session.ticks_since_armed();
    const bool filmed = film && ticks && film->due(session.servo_s());
    if (filmed || (over ? schedule.final_due(ticks) : schedule.due(ticks))) taker.draw(session);
    if (filmed) {
      const auto problem = add_frame(film, taker.target(), session.servo_s());
      if (problem) std::fprintf(stderr, "kerf-visualizer: %s\n", escaped(*problem).c_str());
    }
    while (over ? schedule.final_due(ticks) : schedule.due(ticks)) {
      taker.write(session, frame_file(options.out, schedule.take(ticks)));
      if (!over) break;  // late pictures show the present, each its own
    }
    if (over) continue;
    if (lead) lead->allow(next_tick(session, schedule, film));
    std::this_thread::sleep_for(film && ticks ? pause_before_frame(*film, session) : kIdle);
  }

  if (options.mesh) export_surface(*options.mesh, session.scene(), session.contents());
  if (options.sheet) {
    std::optional<Hand> hand;
    if (session.latest()) hand = hand_of(*session.latest());
    write_contact_sheet(*options.sheet, picture.shown_scene(), session.contents(), hand);
  }
  report.bricks_uploaded = picture.bricks_uploaded();
  report.clean_end = session.ended_cleanly();
  if (options.report) report.write(*options.report);
  tell(options, schedule, film, report);
  return exit_code(session, options.record && !film);
}

}  // namespace kerf
