// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "visualizer/app/run.hpp"
#include "visualizer/view/session.hpp"

namespace kerf {

int exit_code(const Session& session, bool video_is_cut) {
  const bool lost = session.ended() && !session.ended_cleanly();
  if (lost) std::fprintf(stderr, "kerf-visualizer: the controller went away without a clean end\n");
  return lost || video_is_cut ? 1 : 0;
}

}  // namespace kerf
