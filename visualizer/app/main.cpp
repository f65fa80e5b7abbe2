// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/scene/visualizer_error.hpp"

int main(int argc, char** argv) {
  return kerf::run_program("kerf-visualizer", [&] {
    const auto options = kerf::parse_options(argc, argv);
    if (!options) return 0;
    kerf::catch_stop_signals();
    if (options->bench) return kerf::run_bench(*options);
    if (options->headless) return kerf::run_headless(*options);
    if (!kerf::Window::has_screen()) {
      throw kerf::VisualizerError(
          "window: neither DISPLAY nor WAYLAND_DISPLAY is set; use "
          "--headless --out DIR for pictures without a screen");
    }
    return kerf::run_window(*options);
  });
}
