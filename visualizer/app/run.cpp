// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/run.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <sched.h>

#include "shared/posix/cores.hpp"
#include "visualizer/error.hpp"
#include "visualizer/view/session.hpp"
#include "visualizer/view/transfer_file.hpp"

namespace kerf {

Session attach(const VisualizerOptions& options) {
  Session session = Session::attach(options.name, std::chrono::duration<double>(options.wait_s));
  if (options.transfer) {
    check_materials(options.look.opacities, session.scene(), options.transfer->string());
  }
  return session;
}

int exit_code(const Session& session, bool video_is_cut) {
  const bool lost = session.ended() && !session.ended_cleanly();
  if (lost) std::fprintf(stderr, "kerf-visualizer: the controller went away without a clean end\n");
  return lost || video_is_cut ? 1 : 0;
}

std::vector<int> place_process(std::span<const int> cpus) {
  std::vector<int> taken(cpus.begin(), cpus.end());
  if (taken.empty()) {
    taken = allowed_cores();
    if (taken.size() > 1) taken.pop_back();
  }
  cpu_set_t wanted;
  CPU_ZERO(&wanted);
  std::string names;
  for (const int cpu : taken) {
    CPU_SET(static_cast<std::size_t>(cpu), &wanted);
    names += (names.empty() ? "" : ",") + std::to_string(cpu);
  }
  if (sched_setaffinity(0, sizeof(wanted), &wanted) != 0) {
    throw VisualizerError("--cpu: " + names + " is not to be had here; leave the option out");
  }
  constexpr int kKeepWhatTheUserSet = 0;
  setenv("LP_NUM_THREADS", std::to_string(taken.size()).c_str(), kKeepWhatTheUserSet);
  return taken;
}

}  // namespace kerf
