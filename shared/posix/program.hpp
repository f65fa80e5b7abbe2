// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>

#include <unistd.h>

// The frame of every program: main, version, and the files that it finds beside itself.

namespace kerf {

/// The smallest stack that a program accepts. Measured use is 96 KiB at most (a CT read in the
/// sandbox), and each thread gets as much as the first one; a law of the user may need more.
inline constexpr unsigned long long kLeastStackBytes = 1 << 20;

/// A failure whose line a program has printed that was started for it. `what` is for reports.
class AlreadySaid : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The body of every `main` of kerf: runs `work` and returns its exit code. Around it:
/// - no file or socket that it opens becomes standard input, output or error;
/// - its files and folders get the rights that the umask leaves, and all of the user's own;
/// sockets,
///   private folders and what lies in these belong to the user alone;
/// - a file that may not grow any more (`ulimit -f`) is an error of the write, not a signal;
/// - a stack of less than kLeastStackBytes is refused, because it would end in a crash;
/// - a name in KERF_HIDE_SETS that no instruction set has is refused, as it would hide nothing;
/// - an exception becomes one line on standard error, after `program`, and exit code 2; an
///   AlreadySaid the exit code alone;
/// - if standard output could not be written, a line on standard error, and 2 instead of 0.
[[nodiscard]] int run_program(const char* program, const std::function<int()>& work);

/// The name of the processor as Linux reports it, or words for a processor without a name.
[[nodiscard]] std::string processor_name();

/// The day of a run, UTC: 2026-01-31.
[[nodiscard]] std::string today();

/// Path of a file or folder that comes with kerf, such as `scenes/touch.toml`: `name` itself if it
/// exists, else beside the program or in a folder above it, at most six up. If there is none,
/// `name`, so that opening it fails with that name. Start-up only.
[[nodiscard]] std::string find_data_file(const std::string& name);

/// Finds a scene, of which a name is enough, such as `touch`: those of kerf have a folder of
/// their own and the ending .toml.
[[nodiscard]] std::string find_scene_file(const std::string& name);

/// Folder for what the user adds to an installed kerf: $XDG_DATA_HOME/kerf, by default
/// ~/.local/share/kerf; empty if there is neither (XDG Base Directory Specification 0.8).
[[nodiscard]] std::string user_data_folder();

/// Path as of find_data_file, without the current folder, for files that a program runs; empty if
/// there is none.
[[nodiscard]] std::string find_beside_program(const std::string& name);

/// A progress bar on stderr; shows nothing unless it is wanted and stderr is a terminal. The
/// destructor removes it.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted) noexcept : shown_(wanted && isatty(STDERR_FILENO) == 1) {}
  ~ProgressBar() { hide(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Removes the bar until the next `show`, so that another line can go to stderr.
  void hide() const noexcept {
    if (shown_) std::fputs("\r\033[K", stderr);
  }

  /// `share` 0..1, or negative while waiting; `text` names the work.
  void show(double share, const std::string& text) const {
    if (!shown_) return;
    constexpr int kWidth = 40;
    const int full = static_cast<int>(std::clamp(share, 0.0, 1.0) * kWidth);
    std::fprintf(stderr, "\r\033[K[%s%s] %s",
                 std::string(static_cast<std::size_t>(full), '#').c_str(),
                 std::string(static_cast<std::size_t>(kWidth - full), '.').c_str(), text.c_str());
    std::fflush(stderr);
  }

 private:
  bool shown_;
};

}  // namespace kerf
