// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>
#include <utility>

#include "shared/posix/new_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/app/window_run.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/surface/mesh_file.hpp"
#include "visualizer/view/frame_report.hpp"

namespace kerf {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kFrame = std::chrono::microseconds(16'667);  // no faster than screens refresh

/// False when the user wants to leave.
bool step(WindowRun& run, Window& window) {
  const auto begin = Clock::now();
  const PictureSize size = window.size();
  const auto [quit, drawn, leads_hand] = run.step(window.poll(), size, begin);
  window.show_pointer(!leads_hand);
  if (drawn != nullptr) window.present(*drawn);
  return !quit;
}

}  // namespace

int run_window(const VisualizerOptions& options) {
  place_process(options.cpus);
  if (options.mesh) check_export(*options.mesh);
  if (options.report) check_new_file(*options.report);
  Session session = attach(options);
  const Stopwatch since_attached;
  Window window(options.size, Window::Visibility::shown);
  window.set_title("kerf: " + options.name);
  WindowRun run(options, std::move(session), window, since_attached);
  constexpr double kMsPerS = 1e3;
  const double end_ms = options.seconds.value_or(std::numeric_limits<double>::infinity()) * kMsPerS;
  auto next_frame = Clock::now();
  while (!stop_requested() && run.age_ms() < end_ms && step(run, window)) {
    next_frame = std::max(next_frame + kFrame, Clock::now());  // a late wake does not add up
    std::this_thread::sleep_until(next_frame);
  }
  return run.end();
}

}  // namespace kerf
