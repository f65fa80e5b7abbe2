// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include <unistd.h>

#include "shared/posix/new_file.hpp"
#include "shared/posix/page_part.hpp"
#include "shared/posix/stop_signals.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/bench/picture_page.hpp"
#include "visualizer/gl/context.hpp"

namespace kerf {

int run_bench(const VisualizerOptions& options) {
  // A wrong name costs nothing; a run that is stopped leaves nothing behind.
  check_files(options);
  PictureFigures figures;
  figures.size = options.size;
  figures.cores = place_process(options.cpus).size();
  const auto context = make_headless_context();
  figures.gl_renderer = query_gl_driver().renderer;
  const bool terminal = isatty(STDERR_FILENO) == 1;
  const auto progress = [&](const std::string& next, int done, int all) {
    if (terminal) std::fprintf(stderr, "\r\033[K%3d of %d: %s", done, all, next.c_str());
  };
  figures.gradients = measure_gradients();
  figures.rows = measure_pictures(options.size, progress);
  if (terminal) std::fputs("\r\033[K", stderr);
  if (stop_requested()) {
    std::fputs("kerf-visualizer: --bench: stopped; no figures are written\n", stderr);
    return 1;
  }
  if (options.report) write_new_file(*options.report, picture_report(figures));
  if (options.page) write_new_file(*options.page, picture_page(figures));
  if (options.summary) write_page_part(*options.summary, "pictures", picture_summary(figures));
  std::printf("%s\n%s\n%s", figures.gl_renderer.c_str(), picture_table(figures.rows).c_str(),
              gradient_table(figures).c_str());
  return 0;
}

}  // namespace kerf
