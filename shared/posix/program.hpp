// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>

#include <unistd.h>

namespace kerf {

/// The stack that a program asks for. What was measured needs 96 KiB at most (a CT that is read in
/// the sandbox), and threads get as much as the first one; a law of the user's may need more.
inline constexpr unsigned long long kLeastStackBytes = 1 << 20;

/// What every `main` of kerf is: `work`, and around it
/// - no file or socket that it opens becomes its standard input, output or error
/// - files and sockets that it makes are 0600, folders 0700, whatever umask it was started with;
///   they may be of patients
/// - a file that `ulimit -f` does not let grow is an error of the write, not a signal
/// - a stack of less than kLeastStackBytes is refused: it would end in a crash
/// - what it throws is one line on standard error, after `program`, and exit code 2
/// - where its standard output could not be written, so are a line and 2 instead of 0.
/// Returns the exit code, else that of `work`.
[[nodiscard]] int run_program(const char* program, const std::function<int()>& work);

/// The processor's name as Linux tells it, or words that say that it tells none.
[[nodiscard]] std::string processor_name();

/// The day of a run, UTC: 2026-01-31.
[[nodiscard]] std::string today();

/// Where a file or folder lies that comes with kerf, such as `scenes/touch.toml`: as it is named
/// where that exists, else beside the program or in a folder above it, at most six up; the name
/// itself where it lies nowhere, so that who opens it can complain. Start-up only.
[[nodiscard]] std::string shipped_file(const std::string& name);

/// A progress bar on stderr where it is wanted and stderr is a terminal; else it shows nothing. It
/// goes when this does.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted) noexcept : shown_(wanted && isatty(STDERR_FILENO) == 1) {}
  ~ProgressBar() { hide(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Until it is shown again: for another line on stderr.
  void hide() const noexcept {
    if (shown_) std::fputs("\r\033[K", stderr);
  }

  /// `share` 0..1, or negative while waiting; `text` says what for.
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
