// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/notices.hpp"

#include <cstdio>

namespace kerf {

void Notices::say(const Notice& notice, Clock::time_point now) {
  if (notice.problem) {
    std::fprintf(stderr, "kerf-visualizer: %s\n", notice.text.c_str());
  } else {
    std::printf("%s\n", notice.text.c_str());
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

}  // namespace kerf
