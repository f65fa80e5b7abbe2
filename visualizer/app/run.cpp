// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/run.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include <sched.h>

#include "shared/posix/cores.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"
#include "visualizer/error.hpp"
#include "visualizer/surface/mesh_file.hpp"
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

void check_files(const VisualizerOptions& options) {
  if (options.mesh) check_export(*options.mesh);
  const auto path = [](const auto& asked) { return std::filesystem::path(asked.value_or("")); };
  const std::filesystem::path mesh = path(options.mesh), attached = path(options.attached);
  const std::string mesh_ending = mesh.extension().string();
  check_outputs({path(options.transfer)},
                {{"--attached", attached, {}},
                 {"--choice", path(options.choice), {}},
                 {"--record", options.record == "-" ? "" : path(options.record), ".y4m"},
                 {"--export", mesh, mesh_ending},
                 {"--sheet", path(options.sheet), ".png"},
                 {"--report", path(options.report), ".json"},
                 {"--page", path(options.page), ".md"},
                 {"--summary", path(options.summary), ".md"}});
  std::error_code none_there;
  const auto bytes = std::filesystem::file_size(attached, none_there);
  if (none_there || bytes == 0) return;
  throw FileError(attached.string() + ": holds " + std::to_string(bytes) +
                  " bytes, and --attached makes an empty file; give a name that is free");
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
  cpu_set_t had;  // those of `wanted` that there are: one is enough for the call to work
  const bool some = sched_setaffinity(0, sizeof(wanted), &wanted) == 0 &&
                    sched_getaffinity(0, sizeof(had), &had) == 0;
  for (const int cpu : taken) {
    if (some && CPU_ISSET(static_cast<std::size_t>(cpu), &had)) continue;
    throw VisualizerError("--cpu: " + (some ? std::to_string(cpu) : names) +
                          " is not to be had here; leave the option out");
  }
  constexpr int kKeepWhatTheUserSet = 0;
  setenv("LP_NUM_THREADS", std::to_string(taken.size()).c_str(), kKeepWhatTheUserSet);
  return taken;
}

}  // namespace kerf
