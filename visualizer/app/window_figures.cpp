// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/window_figures.hpp"

#include <cstdio>

#include "shared/text/words.hpp"

namespace kerf {

void Notices::say(const Notice& notice, Clock::time_point now) {
  if (notice.problem) {
    std::fprintf(stderr, "kerf-visualizer: %s\n", escaped(notice.text).c_str());
  } else {
    std::printf("%s\n", escaped(notice.text).c_str());
    std::fflush(stdout);  // a pipe would keep it until the end
  }
  last_ = notice;
  shown_until_ = now + kShownFor;
}

void Notices::show(OverlayFigures& figures, Clock::time_point now) const {
  if (now >= shown_until_ || (figures.hidden && !last_.problem)) return;
  figures.banner = last_.text;
  figures.alarm = last_.problem;
}

void ShownRates::show(OverlayFigures& figures, Clock::time_point now) {
  constexpr auto kRateSpan = std::chrono::seconds(1);
  frames_.push_back(now);
  while (now - frames_.front() > kRateSpan) frames_.pop_front();
  if (!shown_since_ || now - *shown_since_ >= kHold) {
    shown_since_ = now;
    tick_rate_hz_ = figures.tick_rate_hz;
    frame_rate_hz_ = frame_rate_hz();
    data_age_ms_ = figures.data_age_ms;
    filmed_frames_ = figures.filmed_frames;
  }
  figures.tick_rate_hz = tick_rate_hz_;
  figures.frame_rate_hz = frame_rate_hz_;
  figures.data_age_ms = data_age_ms_;
  figures.filmed_frames = filmed_frames_;
}

std::optional<double> ShownRates::frame_rate_hz() const {
  if (frames_.size() < 2) return std::nullopt;
  const std::chrono::duration<double> span = frames_.back() - frames_.front();
  return static_cast<double>(frames_.size() - 1) / span.count();
}

}  // namespace kerf
