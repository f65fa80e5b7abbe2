// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "visualizer/app/options.hpp"
#include "visualizer/picture/image_files.hpp"

namespace kerf {

/// Binds this process to the cores `cpus`. Where that is empty, binds it to all cores that it may
/// use but the last one, which is the servo's; to the only one if there is one. Call before any
/// other thread exists. Sets LP_NUM_THREADS, the number of threads of a software GL, unless it is
/// set.
///
/// Returns the cores taken. Throws VisualizerError if one of `cpus` is not to be had.
std::vector<int> place_process(std::span<const int> cpus);

/// Without --renderer, and on a software GL: `cast`, which draws the same several times faster.
/// Reads the current context.
void take_default_renderer(VisualizerOptions& options);

/// Refuses now what could not be written later, or would cost another file. Throws FileError, or
/// VisualizerError for the name of a mesh.
void check_files(const VisualizerOptions& options);

class Session;

/// The session that the options name, whose materials those of --transfer are.
[[nodiscard]] Session attach(const VisualizerOptions& options);

/// 0 if the controller still runs or ended cleanly, 1 if it went away without a word, which
/// is reported on stderr, or if a video is cut short.
[[nodiscard]] int exit_code(const Session& session, bool video_is_cut);

/// Begins the video of --record, and says on stderr how fast its file grows. Throws FileError.
void begin_recording(const VisualizerOptions& options, PictureSize size, std::optional<Film>& film);

/// Follows one run of a controller and writes frame-0001.png and so on into `options.out`; the last
/// one shows the final state. A video goes on to the end of the run. Returns the `exit_code`;
/// throws VisualizerError, FileError or SegmentError for bad input or set-up.
[[nodiscard]] int run_headless(const VisualizerOptions& options);

/// The window; follows restarted controllers too. Returns the `exit_code` when the user closes it
/// or the time is over; the video of a window that changes its size is cut short. Throws as
/// run_headless does.
[[nodiscard]] int run_window(const VisualizerOptions& options);

/// Times every renderer on a volume of its own, without a controller: a table on stdout, all
/// figures as JSON in `options.report`, the tables as a part of `options.page`. Returns 1 if it was
/// stopped. Throws VisualizerError or FileError for bad set-up.
[[nodiscard]] int run_bench(const VisualizerOptions& options);

}  // namespace kerf
