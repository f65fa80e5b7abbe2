// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include <unistd.h>

#include "shared/posix/new_file.hpp"
#include "visualizer/bench/picture_page.hpp"
#include "visualizer/cpu_placement.hpp"
#include "visualizer/run.hpp"
#include "visualizer/stop_signal.hpp"

namespace kerf {

int run_bench(const VisualizerOptions& options) {
  // A wrong name costs nothing; a run that is stopped leaves nothing behind.
  for (const auto& file : {options.report, options.page}) {
    if (file) check_new_file(*file);
  }
  const std::size_t cores = place_process(options.cpus).size();
  const auto context = make_headless_context();
  const GlDriver driver = query_gl_driver();
  const bool terminal = isatty(STDERR_FILENO) == 1;
  const auto progress = [&](const std::string& next, int done, int all) {
    if (terminal) std::fprintf(stderr, "\r\033[K%3d of %d: %s", done, all, next.c_str());
  };
  const auto rows = measure_pictures(options.size, progress);
  if (terminal) std::fputs("\r\033[K", stderr);
  if (stop_requested()) {
    std::fputs("kerf-visualizer: --bench: stopped; no figures are written\n", stderr);
    return 1;
  }
  if (options.report) {
    write_new_file(*options.report, picture_report(rows, driver, options.size, cores));
  }
  if (options.page) {
    write_new_file(*options.page, picture_page(rows, driver, options.size, cores));
  }
  std::printf("%s\n%s", driver.renderer.c_str(), picture_table(rows).c_str());
  return 0;
}

}  // namespace kerf
