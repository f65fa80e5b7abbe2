// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <string>
#include <thread>
#include <utility>

#include "shared/posix/new_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/app/window_run.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/sound/sound_link.hpp"
#include "visualizer/sound/tool_sound.hpp"
#include "visualizer/surface/mesh_file.hpp"
#include "visualizer/view/frame_report.hpp"

namespace kerf {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kFrame = std::chrono::microseconds(16'667);  // no faster than screens refresh

/// What the window lets be heard.
class WindowSound {
 public:
  explicit WindowSound(bool mute) : mute_(mute) {}

  /// After each frame. The one line about a missing device goes to the terminal; who asks for sound
  /// by the key is told in the picture too.
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
  const PictureSize size = window.size();
  const WindowInput input = window.poll();
  const auto [quit, drawn, leads_hand] = run.step(input, size, begin);
  sound.step(input, run, begin);
  window.show_pointer(!leads_hand);
  if (drawn != nullptr) window.present(*drawn);
  return !quit;
}

}  // namespace

int run_window(const VisualizerOptions& options) {
  place_process(options.cpus);
  check_files(options);
  WindowSound sound(options.mute);  // before any thread
  Session session = attach(options);
  const Stopwatch since_attached;
  Window window(options.size, Window::Visibility::shown);
  window.set_title("kerf: " + options.name);
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
