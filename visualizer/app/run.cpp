// SPDX-License-Identifier: Apache-2.0

#include "visualizer/app/run.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <sched.h>

#include "shared/posix/atomic_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/posix/threads.hpp"
#include "shared/text/text.hpp"
#include "visualizer/app/window_run.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/session.hpp"
#include "visualizer/scene/visualizer_error.hpp"
#include "visualizer/sound/spindle_sound.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

Session attach(const VisualizerOptions& options) {
  Session session = Session::attach(options.name, std::chrono::duration<double>(options.wait_s));
  if (options.transfer) {
    check_materials(options.settings.opacities, session.scene(), options.transfer->string());
  }
  return session;
}

void take_default_renderer(VisualizerOptions& options) {
  if (!options.renderer_is_given && query_gl_driver().software) options.settings.renderer = "cast";
}

int exit_code(const Session& session, bool video_is_cut) {
  const bool lost = session.ended() && !session.ended_cleanly();
  if (lost) std::fprintf(stderr, "kerf-visualizer: the controller went away without a clean end\n");
  return lost || video_is_cut ? 1 : 0;
}

void begin_recording(const VisualizerOptions& options, PictureSize size,
                     std::optional<Film>& film) {
  const std::string growth = video_growth(*options.record, size, options.video_hz);
  if (!growth.empty()) {
    std::fprintf(stderr, "kerf-visualizer: video %s: %s\n", escaped(*options.record).c_str(),
                 growth.c_str());
  }
  film.emplace(*options.record, size, options.video_hz);
}

void check_files(const VisualizerOptions& options) {
  if (options.mesh) check_export(*options.mesh);
  if (options.record) check_video(*options.record);
  const auto path = [](const auto& asked) { return std::filesystem::path(asked.value_or("")); };
  const std::filesystem::path mesh = path(options.mesh), attached = path(options.attached);
  const std::string mesh_ending = mesh.extension().string();
  check_outputs({path(options.transfer)},
                {{"--attached", attached, {}},
                 {"--choice", path(options.choice), {}},
                 {"--record", options.record == "-" ? "" : path(options.record), ".y4m"},
                 {"--export", mesh, mesh_ending},
                 {"--sheet", path(options.sheet), ".png"},
                 {"--report", path(options.report), ".json"},
                 {"--page", path(options.page), ".md"}});
  std::error_code none_there;
  const auto bytes = std::filesystem::file_size(attached, none_there);
  if (none_there || bytes == 0) return;
  throw FileError(attached.string() + ": holds " + std::to_string(bytes) +
                  " bytes, and --attached makes an empty file; give a name that is free");
}

std::vector<int> place_process(std::span<const int> cpus) {
  std::vector<int> taken(cpus.begin(), cpus.end());
  if (taken.empty()) {
    taken = allowed_cores();
    if (taken.size() > 1) taken.pop_back();
  }
  cpu_set_t wanted;
  CPU_ZERO(&wanted);
  std::string names;
  for (const int cpu : taken) {
    CPU_SET(static_cast<std::size_t>(cpu), &wanted);
    names += (names.empty() ? "" : ",") + std::to_string(cpu);
  }
  cpu_set_t had;  // those of `wanted` that there are: one is enough for the call to work
  const bool some = sched_setaffinity(0, sizeof(wanted), &wanted) == 0 &&
                    sched_getaffinity(0, sizeof(had), &had) == 0;
  for (const int cpu : taken) {
    if (some && CPU_ISSET(static_cast<std::size_t>(cpu), &had)) continue;
    throw VisualizerError("--cpu: " + (some ? std::to_string(cpu) : names) +
                          " is not to be had here; leave the option out");
  }
  constexpr int kKeepWhatTheUserSet = 0;
  setenv("LP_NUM_THREADS", std::to_string(taken.size()).c_str(), kKeepWhatTheUserSet);
  return taken;
}

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kFrame = std::chrono::microseconds(16'667);  // no faster than screens refresh

/// What the window lets be heard.
class WindowSound {
 public:
  explicit WindowSound(bool mute) : mute_(mute) {}

  /// After each frame. The one line about a missing device goes to the terminal; who asks for sound
  /// by the key is reported in the picture too.
  void step(const WindowInput& input, WindowRun& run, Clock::time_point now) {
    const auto toggles = std::count(input.keys.begin(), input.keys.end(), 'a');
    if (toggles % 2 != 0) {
      mute_ = !mute_;
      const std::string on = problem_.empty() ? "sound: on" : problem_;
      run.say({mute_ ? "sound: off" : on, !mute_ && !problem_.empty()}, now);
    }
    const Session& session = run.session();
    const auto& tick = session.latest();
    link_.send(tick && !session.ended() ? tool_sound(*tick) : ToolSound{}, mute_);
    if (const auto problem = link_.heard()) {
      problem_ = *problem;
      std::fprintf(stderr, "kerf-visualizer: %s\n", problem_.c_str());
    }
  }

 private:
  SoundLink link_;
  std::string problem_;
  bool mute_;
};

/// False when the user wants to leave.
bool step(WindowRun& run, Window& window, WindowSound& sound) {
  const auto begin = Clock::now();
  const WindowInput input = window.poll();
  const auto [quit, drawn, parts, leads_hand] = run.step(input, input.size, begin);
  sound.step(input, run, begin);
  window.show_pointer(!leads_hand);
  if (drawn != nullptr) window.present(*drawn, parts);
  return !quit;
}

}  // namespace

int run_window(const VisualizerOptions& asked) {
  VisualizerOptions options = asked;
  place_process(options.cpus);
  check_files(options);
  WindowSound sound(options.mute);  // before any thread
  Session session = attach(options);
  const Stopwatch since_attached;
  Window window({.size = options.size_is_given ? std::optional(options.size) : std::nullopt,
                 .full_screen = options.full_screen,
                 .monitor = options.monitor > 0 ? std::optional(options.monitor) : std::nullopt},
                Window::Visibility::shown);
  options.size = window.size();
  window.set_title("kerf: " + options.name);
  take_default_renderer(options);
  WindowRun run(options, std::move(session), window, since_attached);
  constexpr double kMsPerS = 1e3;
  const double end_ms = options.seconds.value_or(std::numeric_limits<double>::infinity()) * kMsPerS;
  auto next_frame = Clock::now();
  while (!stop_requested() && run.age_ms() < end_ms && step(run, window, sound)) {
    next_frame = std::max(next_frame + kFrame, Clock::now());  // a late wake does not add up
    std::this_thread::sleep_until(next_frame);
  }
  return run.end();
}

}  // namespace kerf
