// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>
#include <string>

#include <unistd.h>

namespace kerf {

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
