// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/options.hpp"

namespace kerf {

/// Follows one run of a controller and writes frame-0001.png and so on into `options.out`; the last
/// one shows the final state. A video goes on to the end of the run. Returns the exit code: 0 when
/// the controller ended cleanly, when the pictures are complete or when the time is over, 1 when it
/// went away without a word or when a video could not be written to its end. Throws VisualizerError
/// or SegmentError for bad input or set-up.
[[nodiscard]] int run_headless(const VisualizerOptions& options);

/// The window; follows restarted controllers too. Returns 0 when the user closes it.
[[nodiscard]] int run_window(const VisualizerOptions& options);

/// Times every renderer on a volume of its own, without a controller: a table on stdout, all
/// figures as JSON in `options.report`, a page in `options.page`. Returns 1 where it was stopped.
/// Throws VisualizerError or FileError for bad set-up.
[[nodiscard]] int run_bench(const VisualizerOptions& options);

}  // namespace kerf
