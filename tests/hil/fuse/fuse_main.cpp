// SPDX-License-Identifier: Apache-2.0
// The tests run in a child: a process that dies while it holds a file of a mount that it serves
// itself waits for its own answer, and even SIGKILL does not end it. Its parent takes the mount
// away.
#define DOCTEST_CONFIG_IMPLEMENT
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hil/front/fuse/fuse_mount.hpp"
#include "hil/hil_error.hpp"
#include "tests/hil/fuse/spread.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

constexpr int kSkipped = 77;
constexpr int kFailed = 1;
constexpr int kLongestMs = 110'000;  // less than ctest grants
constexpr int kTimedRuns = 5;        // in one program, each as long as KERF_TIMING_SECONDS
constexpr int kExitMs = 2'000;
constexpr int kStepMs = 20;

int run_tests(int argc, char** argv) {
  try {
    const kerf::test::TemporaryFolder folder;
    const kerf::FuseMount probe(folder.path());
  } catch (const kerf::HilError& error) {
    std::printf("skipped: %s\n", error.what());
    return kSkipped;
  }
  doctest::Context context(argc, argv);
  return context.run();
}

void unmount_below(const std::filesystem::path& folder, int flags) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    umount2(entry.path().c_str(), flags);
  }
}

/// Is its first thread on its way out? (Flag PF_EXITING in the ninth field of its stat.)
bool is_ending(pid_t child) {
  std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
  std::string field;
  std::getline(stat, field, ')');
  for (int number = 3; number <= 8; ++number) stat >> field;
  unsigned long flags = 0;
  stat >> flags;
  constexpr unsigned long kExiting = 4;
  return (flags & kExiting) != 0;
}

/// Long measurements, by KERF_TIMING_SECONDS, are not started by ctest.
int longest_ms() {
  return kLongestMs + kTimedRuns * (kerf::test::timing_ticks() - kerf::test::kTimingTicks);
}

/// Waits for the end of `child`, whose mounts lie in `folder`. Returns its exit code.
int watch(pid_t child, const std::filesystem::path& folder) {
  const int limit_ms = longest_ms() / kStepMs * kStepMs;
  int status = 0;
  int run_ms = 0;
  int ending_ms = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(kStepMs));
    run_ms += kStepMs;
    if (run_ms == limit_ms) {
      std::fprintf(stderr, "fuse tests: still running after %d s: killed\n", limit_ms / 1000);
      kill(child, SIGKILL);
    }
    if (is_ending(child)) ending_ms += kStepMs;
    if (ending_ms == kExitMs) unmount_below(folder, MNT_FORCE);
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  std::fprintf(stderr, "fuse tests: ended by signal %d\n", WTERMSIG(status));
  return kFailed;
}

}  // namespace

/// Skips with its reason, exit code 77, if nothing can be mounted.
int main(int argc, char** argv) {
  const std::string folder = kerf::test::TemporaryFolder().path();
  std::filesystem::create_directory(folder);
  setenv("TMPDIR", folder.c_str(), 1);
  const pid_t child = fork();
  if (child < 0) return kFailed;
  if (child == 0) return run_tests(argc, argv);
  const int result = watch(child, folder);
  unmount_below(folder, MNT_DETACH);
  std::filesystem::remove_all(folder);
  return result;
}
