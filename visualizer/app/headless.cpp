// SPDX-License-Identifier: Apache-2.0

#include "visualizer/app/headless.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <imgui.h>
#include <unistd.h>

#include "shared/numeric/statistics.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/posix/tick_lead.hpp"
#include "shared/text/text.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/app/shared_view.hpp"
#include "visualizer/compose/picture_layers.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/picture/picture.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/visualizer_error.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

namespace {

constexpr PictureSize kTile{320, 320};
constexpr int kColumns = 3;
constexpr int kFiner = 2;  // drawn so many times larger, so that edges are smooth
constexpr std::uint8_t kBackdrop = 46;
constexpr std::uint8_t kInk = 240;

/// 8-bit RGB, first row at the top.
struct Sheet {
  PictureSize size;
  std::vector<std::uint8_t> rgb;

  [[nodiscard]] std::uint8_t* pixel(int x, int y) {
    return &rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) +
                     static_cast<std::size_t>(x))];
  }
};

/// The mean of each square of `kFiner` pixels.
std::vector<std::uint8_t> reduced(const std::vector<std::uint8_t>& fine) {
  std::vector<std::uint8_t> tile;
  for (int y = 0; y < kTile.height; ++y) {
    for (int x = 0; x < 3 * kTile.width; ++x) {
      int sum = 0;
      for (int i = 0; i < kFiner * kFiner; ++i) {
        const int column = 3 * (x / 3 * kFiner + i % kFiner) + x % 3;
        const int row = y * kFiner + i / kFiner;
        sum += fine[static_cast<std::size_t>(row) * 3 * kFiner * kTile.width +
                    static_cast<std::size_t>(column)];
      }
      tile.push_back(static_cast<std::uint8_t>(sum / (kFiner * kFiner)));
    }
  }
  return tile;
}

/// Writes with the overlay's font, twice its size.
class Pen {
 public:
  static constexpr int kScale = 2;
  static constexpr int kHeightPx = kScale * 13;  ///< of a line

  Pen() : font_(atlas_.AddFontDefault()) {
    int height = 0;
    atlas_.GetTexDataAsAlpha8(&coverage_, &width_, &height);
    height_ = height;
  }
  void write(std::string_view text, int x, int y, Sheet& sheet) const {
    for (const char letter : text) {
      const ImFontGlyph& glyph = *font_->FindGlyph(static_cast<ImWchar>(letter));
      const int left = static_cast<int>(glyph.U0 * static_cast<float>(width_) + 0.5F);
      const int top = static_cast<int>(glyph.V0 * static_cast<float>(height_) + 0.5F);
      const int wide = kScale * static_cast<int>(glyph.X1 - glyph.X0 + 0.5F);
      const int high = kScale * static_cast<int>(glyph.Y1 - glyph.Y0 + 0.5F);
      for (int j = 0; j < high; ++j) {
        for (int i = 0; i < wide; ++i) {
          if (coverage_[(top + j / kScale) * width_ + left + i / kScale] == 0) continue;
          std::fill_n(sheet.pixel(x + kScale * static_cast<int>(glyph.X0) + i,
                                  y + kScale * static_cast<int>(glyph.Y0) + j),
                      3, kInk);
        }
      }
      x += kScale * static_cast<int>(glyph.AdvanceX);
    }
  }

 private:
  ImFontAtlas atlas_;
  ImFont* font_;
  unsigned char* coverage_ = nullptr;
  int width_ = 0, height_ = 0;
};

}  // namespace

void write_contact_sheet(const std::filesystem::path& file, const SceneView& scene,
                         std::span<const VolumeContent> contents, const Hands& hands,
                         const std::optional<CameraPose>& seen_from) {
  constexpr int kMarginPx = 10;
  constexpr double kAspect = static_cast<double>(kTile.width) / kTile.height;
  constexpr double kNearer = 1.5;  // one tooth does not fill its box
  constexpr double kLower = 0.07;  // of the tile's height: as seen from above it stands high
  constexpr double kReach = 3.0;   // radii of what is framed: room for the tool
  OrbitCamera camera;
  camera.frame(scene.corners(), kAspect);
  if (seen_from) {
    camera.look(*seen_from);
  } else {
    if (scene.volumes.size() == 1) camera.zoom(kNearer);
    camera.pan(0.0, -kLower);
  }
  const View view = camera.view(kAspect, kReach * camera.radius_mm());
  const RenderTarget target({kFiner * kTile.width, kFiner * kTile.height});

  const auto kinds = renderer_kinds();
  const int rows = (static_cast<int>(kinds.size()) + kColumns - 1) / kColumns;
  Sheet sheet{{kColumns * kTile.width, rows * kTile.height}, {}};
  sheet.rgb.resize(static_cast<std::size_t>(sheet.size.width * sheet.size.height) * 3);
  const Pen pen;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    ScenePainter painter(std::string(kinds[i]), scene, contents);
    constexpr float kGrey = kBackdrop / 255.0F;
    target.bind();
    glClearColor(kGrey, kGrey, kGrey, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    painter.hold(hands);
    painter.draw_volumes(ScenePainter::Layer::opaque, view, target);
    for (const auto& hand : hands) {  // no arrow: it would hide what is to be compared
      if (hand) painter.draw_tool(*hand, view, target);
    }
    painter.draw_volumes(ScenePainter::Layer::translucent, view, target);
    const std::vector<std::uint8_t> tile = reduced(target.read_rgb());
    const int left = static_cast<int>(i) % kColumns * kTile.width;
    const int top = static_cast<int>(i) / kColumns * kTile.height;
    for (int y = 0; y < kTile.height; ++y) {
      std::copy_n(tile.begin() + std::ptrdiff_t{3} * y * kTile.width, 3 * kTile.width,
                  sheet.pixel(left, top + y));
    }
    pen.write(kinds[i], left + kMarginPx, top + kTile.height - kMarginPx - Pen::kHeightPx, sheet);
  }
  write_png(file, sheet.size, sheet.rgb);
}

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
        scale_(options.panel_scale.value_or(1.0)),
        panels_(options.panels) {}

  void draw(Session& session) {
    figures_ = overlay_figures(session);
    figures_.score = picture_.score(session);
    figures_.scale = scale_;
    figures_.hidden = !panels_;
    if (!panels_) figures_.banner.clear();  // nothing lies over what is measured
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
  bool panels_;
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

void check_lead(const VisualizerOptions& options) {
  if (!options.lead) return;
  if (const std::string why = TickLead::problem_with(*options.lead); !why.empty()) {
    throw VisualizerError(why);
  }
}

void forget_frames(FrameReport& report) {
  report.cpu_ms.clear();
  report.wall_ms.clear();
  report.redrawn.clear();
  report.latency_ms.clear();
}

/// What is written once, at the end of the run.
void keep_results(const VisualizerOptions& options, Session& session, Picture& picture,
                  FrameReport& report) {
  if (options.mesh) export_surface(*options.mesh, session.scene(), session.contents());
  if (options.sheet) {
    write_contact_sheet(*options.sheet, picture.shown_scene(), session.contents(),
                        hands_of(session), options.settings.camera);
  }
  report.bricks_uploaded = picture.bricks_uploaded();
  report.clean_end = session.ended_cleanly();
  if (options.report) report.write(*options.report);
}

/// The report of a run that has drawn nothing yet, in the current context.
FrameReport new_report(const VisualizerOptions& options, ContextKind context) {
  return {.renderer = options.settings.renderer,
          .gl_renderer = query_gl_driver().renderer,
          .context = to_string(context),
          .width = options.size.width,
          .height = options.size.height};
}

/// A message on stderr that does not end the run.
void say(const std::string& text) {
  std::fprintf(stderr, "kerf-visualizer: %s\n", text.c_str());
}

}  // namespace

int run_headless(const VisualizerOptions& asked) {
  VisualizerOptions options = asked;
  place_process(options.cpus);
  if (options.frames > 0) check_new_folder(options.out);
  check_files(options);
  check_lead(options);
  const auto context = make_headless_context();
  take_default_renderer(options);
  FrameReport report = new_report(options, context->kind());
  Session session = attach(options);
  report.attach_ms = session.attach_ms();
  const Stopwatch since_attached;
  const double aspect = static_cast<double>(options.size.width) / options.size.height;
  Picture picture(session, options.settings, aspect);
  FrameTaker taker(picture, options, report);
  taker.draw(session);  // not kept: the driver compiles shaders at their first use
  if (options.attached) write_new_file(*options.attached, "");
  report.late_join_ms = since_attached.wall_ms();
  forget_frames(report);

  SharedView shared(options);
  std::optional<SeenBodies> bodies;
  if (options.aov.any()) bodies.emplace(session, picture, options.size, options.aov);
  std::optional<Film> film;
  if (options.record) begin_recording(options, options.size, film);
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
    if (bodies) bodies->update(session);
    if (const auto news = shared.step(picture.camera(), 0)) say(news->text);
    const auto ticks = session.ticks_since_armed();
    const bool filmed = film && ticks && film->due(session.servo_s());
    if (filmed || (over ? schedule.final_due(ticks) : schedule.due(ticks))) taker.draw(session);
    if (filmed) {
      const auto problem = add_frame(film, taker.target(), session.servo_s());
      if (problem) say(escaped(*problem));
    }
    while (over ? schedule.final_due(ticks) : schedule.due(ticks)) {
      const std::filesystem::path file = frame_file(options.out, schedule.take(ticks));
      taker.write(session, file);
      if (bodies) write_seen(bodies->draw(session, picture), options.size, file);
      if (!over) break;  // late pictures show the present, each its own
    }
    if (over) continue;
    if (lead) lead->allow(next_tick(session, schedule, film));
    std::this_thread::sleep_for(film && ticks ? pause_before_frame(*film, session) : kIdle);
  }

  keep_results(options, session, picture, report);
  tell(options, schedule, film, report);
  return exit_code(session, options.record && !film);
}

}  // namespace kerf
